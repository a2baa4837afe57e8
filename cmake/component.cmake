# An area of cilantro as a library and a package of its own, with what it depends on: cilantro::NAME, which
# find_package(cilantro COMPONENTS NAME) finds. Interfaces (*.cppm), partitions that only units import
# (*.part.cpp) and units (*.cpp) are those of the folder that calls it, which lies in modules/ or outside the tree.
#
#   cilantro_add_component(NAME [USE COMPONENT...] [FIND "PACKAGE ARGUMENT..."...] [LINK TARGET...])
#
# USE: components that its interfaces import. FIND: what find_package is called with, here and wherever the component is
# found. LINK: the targets of those packages that its units need.

# Two versions of the library are two libraries with the same names: a component goes with the one it was compiled for.
if(DEFINED cilantro_VERSION)  # Found.
  set_property(GLOBAL PROPERTY CILANTRO_VERSION ${cilantro_VERSION})
else()
  set_property(GLOBAL PROPERTY CILANTRO_VERSION ${PROJECT_VERSION})
endif()
set_property(GLOBAL PROPERTY CILANTRO_COMPONENT_TEMPLATE ${CMAKE_CURRENT_LIST_DIR}/cilantro-component-config.cmake.in)

function(cilantro_add_component name)
  cmake_parse_arguments(PARSE_ARGV 1 component "" "" "USE;FIND;LINK")
  if(component_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "cilantro_add_component(${name}): what is \"${component_UNPARSED_ARGUMENTS}\"? There are USE, FIND and LINK.")
  endif()
  include(CMakePackageConfigHelpers)
  include(GNUInstallDirs)
  get_property(cilantro_component_version GLOBAL PROPERTY CILANTRO_VERSION)
  set(cilantro_component ${name})
  set(cilantro_component_needs "")
  set(used_components "")
  foreach(used IN LISTS component_USE)
    if(NOT TARGET cilantro::${used})
      string(TOUPPER ${used} option)
      message(FATAL_ERROR "cilantro::${name} needs cilantro::${used}: set CILANTRO_BUILD_${option}=ON, or find it as a component.")
    endif()
    list(APPEND used_components cilantro::${used})
    string(APPEND cilantro_component_needs
      "find_dependency(cilantro-${used} ${cilantro_component_version} EXACT CONFIG HINTS \"\${CMAKE_CURRENT_LIST_DIR}/..\")\n")
  endforeach()
  foreach(package IN LISTS component_FIND)
    separate_arguments(arguments UNIX_COMMAND "${package}")
    find_package(${arguments} REQUIRED GLOBAL)  # Who links the component lies in other folders.
    string(APPEND cilantro_component_needs "find_dependency(${package})\n")
  endforeach()

  file(GLOB_RECURSE interfaces CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cppm)
  file(GLOB_RECURSE units CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  file(GLOB_RECURSE parts CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.part.cpp)
  list(REMOVE_ITEM units ${parts})
  # A build folder in this one holds units of CMake's.
  list(FILTER units EXCLUDE REGEX "/CMakeFiles/")
  # Vector kernels belong to the library, which compiles them for each target.
  list(FILTER units EXCLUDE REGEX "/kernels/")
  add_library(cilantro_${name})
  add_library(cilantro::${name} ALIAS cilantro_${name})
  set_target_properties(cilantro_${name} PROPERTIES
    EXPORT_NAME ${name} CXX_SCAN_FOR_MODULES ON POSITION_INDEPENDENT_CODE ON)
  # As the library itself: the same bits on every machine.
  target_compile_options(cilantro_${name} PRIVATE -ffp-contract=off)
  target_sources(cilantro_${name}
    PUBLIC FILE_SET CXX_MODULES BASE_DIRS ${CMAKE_CURRENT_SOURCE_DIR} FILES ${interfaces}
    PRIVATE FILE_SET implementation_partitions TYPE CXX_MODULES BASE_DIRS ${CMAKE_CURRENT_SOURCE_DIR} FILES ${parts}
    PRIVATE ${units})
  target_link_libraries(cilantro_${name} PUBLIC cilantro::cilantro ${used_components} PRIVATE ${component_LINK})
  cilantro_fit_language(cilantro_${name} ${CMAKE_SOURCE_DIR})

  if(NOT DEFINED CILANTRO_INSTALL)
    set(CILANTRO_INSTALL ${PROJECT_IS_TOP_LEVEL})
  endif()
  if(CILANTRO_INSTALL)
    set(folder ${CMAKE_INSTALL_LIBDIR}/cmake/cilantro-${name})
    install(TARGETS cilantro_${name} EXPORT cilantro-${name}-targets
      ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${name}
      LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${name}
      FILE_SET CXX_MODULES DESTINATION ${CMAKE_INSTALL_LIBDIR}/cilantro/modules/${name} COMPONENT ${name})
    install(EXPORT cilantro-${name}-targets
      NAMESPACE cilantro:: DESTINATION ${folder} CXX_MODULES_DIRECTORY modules COMPONENT ${name})
    get_property(template GLOBAL PROPERTY CILANTRO_COMPONENT_TEMPLATE)
    configure_package_config_file(${template} cilantro-${name}-config.cmake INSTALL_DESTINATION ${folder})
    write_basic_package_version_file(cilantro-${name}-config-version.cmake
      VERSION ${cilantro_component_version} COMPATIBILITY ExactVersion)
    install(FILES ${CMAKE_CURRENT_BINARY_DIR}/cilantro-${name}-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/cilantro-${name}-config-version.cmake
      DESTINATION ${folder} COMPONENT ${name})
  endif()
endfunction()
