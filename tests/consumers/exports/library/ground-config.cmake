include(CMakeFindDependencyMacro)
find_dependency(cilantro)
include(${CMAKE_CURRENT_LIST_DIR}/ground-targets.cmake)
