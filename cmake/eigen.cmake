# Which Eigen a project has, and how it allocates there.

# The folder of the Eigen that was found, and its version: from its headers, since an Eigen within the project
# (FetchContent) tells CMake none.
function(cilantro_find_out_about_eigen folder version)
  get_property(found TARGET Eigen3::Eigen PROPERTY INTERFACE_INCLUDE_DIRECTORIES)
  string(REGEX MATCH "[^$<>:;]*/[^$<>;]+" found "${found}")  # Also out of a $<BUILD_INTERFACE:...>.
  cilantro_version_of_eigen("${found}" found_version)
  set(${folder} "${found}" PARENT_SCOPE)
  set(${version} "${found_version}" PARENT_SCOPE)
endfunction()

# Nothing if there is no Eigen in that folder.
function(cilantro_version_of_eigen folder result)
  set(version "")
  foreach(file IN ITEMS Eigen/Version Eigen/src/Core/util/Macros.h)
    if(NOT version AND EXISTS "${folder}/${file}")
      file(STRINGS "${folder}/${file}" lines REGEX "^#define EIGEN_(WORLD|MAJOR|MINOR|PATCH)_VERSION +[0-9]+")
      string(REGEX MATCHALL "VERSION +[0-9]+" version "${lines}")
      list(TRANSFORM version REPLACE "VERSION +" "")
      list(JOIN version "." version)
    endif()
  endforeach()
  set(${result} "${version}" PARENT_SCOPE)
endfunction()

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
