# Leaves one sentence in `cilantro_cannot_be_used` where CMake's own message would not say what to do.
set(cilantro_cannot_be_used "")
if(NOT CMAKE_CXX_COMPILER_LOADED)
  set(cilantro_cannot_be_used
    "cilantro is a library for C++, and this project has none: write `project(... LANGUAGES CXX)`.")
elseif(NOT CMAKE_GENERATOR MATCHES "Ninja")
  set(cilantro_cannot_be_used
    "cilantro consists of C++20 modules, which need the Ninja generator: configure with `cmake -G Ninja`.")
elseif(NOT CMAKE_CXX_COMPILER_ID STREQUAL "Clang" OR CMAKE_CXX_COMPILER_VERSION VERSION_LESS 22)
  string(CONCAT cilantro_cannot_be_used
    "cilantro needs Clang 22 or newer, and this is ${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}: "
    "install clang-22 and clang-tools-22, then configure a new folder with `CXX=clang++-22`.")
elseif(NOT CMAKE_CXX_COMPILER_CLANG_SCAN_DEPS)
  string(CONCAT cilantro_cannot_be_used
    "cilantro consists of C++20 modules, and clang-scan-deps, which finds their order, is missing: "
    "install clang-tools-22, then configure a new folder.")
endif()
