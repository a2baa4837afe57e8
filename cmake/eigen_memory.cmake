# How Eigen allocates under the flags of the project and those given: with plain malloc (1), or in a way of its own
# that plain free cannot undo (0). Importers of the library must agree with it (modules/eigen.cppm).
include(CheckCXXSourceCompiles)

function(cilantro_ask_whether_eigen_uses_malloc eigen_folder flags result)
  string(TOUPPER "CMAKE_CXX_FLAGS_${CMAKE_BUILD_TYPE}" flags_of_build_type)
  set(all "${CMAKE_CXX_FLAGS} ${${flags_of_build_type}} ${flags}")
  # Asking takes a second, and nothing else changes it.
  if(NOT all MATCHES "-m[a-z]|-fsanitize|-[DU] ?EIGEN")
    set(${result} 1 PARENT_SCOPE)
    return()
  endif()
  string(SHA1 answer "${all}")
  set(answer CILANTRO_EIGEN_USES_MALLOC_${answer})
  set(CMAKE_REQUIRED_INCLUDES ${eigen_folder})
  set(CMAKE_REQUIRED_DEFINITIONS -DEIGEN_MAX_ALIGN_BYTES=16)
  set(CMAKE_REQUIRED_FLAGS "${${flags_of_build_type}} ${flags}")
  set(CMAKE_REQUIRED_LIBRARIES "")
  set(CMAKE_REQUIRED_LINK_OPTIONS "")
  set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)  # Only compiled: whether it links says nothing of Eigen.
  set(CMAKE_REQUIRED_QUIET TRUE)
  check_cxx_source_compiles("
    #include <Eigen/Core>
    static_assert(EIGEN_MALLOC_ALREADY_ALIGNED);
    int main() {}" ${answer})
  if(${answer})
    set(${result} 1 PARENT_SCOPE)
  else()
    set(${result} 0 PARENT_SCOPE)
  endif()
endfunction()
