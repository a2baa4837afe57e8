# Asks Eigen how it allocates under the compiler's flags: with plain malloc, or in a way of its own that
# plain free cannot undo. Importers of the library must agree with it (modules/eigen.cppm).
include(CheckCXXSourceCompiles)
set(CMAKE_REQUIRED_LIBRARIES Eigen3::Eigen)
set(CMAKE_REQUIRED_DEFINITIONS -DEIGEN_MAX_ALIGN_BYTES=16)
# The flags may have changed since the last time.
unset(CILANTRO_EIGEN_USES_MALLOC CACHE)
check_cxx_source_compiles("
  #include <Eigen/Core>
  static_assert(EIGEN_MALLOC_ALREADY_ALIGNED);
  int main() {}" CILANTRO_EIGEN_USES_MALLOC)
unset(CMAKE_REQUIRED_LIBRARIES)
unset(CMAKE_REQUIRED_DEFINITIONS)
set(CILANTRO_EIGEN_MALLOC_ALREADY_ALIGNED 0)
if(CILANTRO_EIGEN_USES_MALLOC)
  set(CILANTRO_EIGEN_MALLOC_ALREADY_ALIGNED 1)
endif()
