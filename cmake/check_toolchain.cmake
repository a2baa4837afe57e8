# Stops with one sentence where CMake's own message would not say what to do.
if(NOT CMAKE_GENERATOR MATCHES "Ninja")
  message(FATAL_ERROR
    "cilantro consists of C++20 modules, which need the Ninja generator: configure with `cmake -G Ninja`.")
endif()
if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "Clang" OR CMAKE_CXX_COMPILER_VERSION VERSION_LESS 22)
  message(FATAL_ERROR
    "cilantro needs Clang 22 or newer, and this is ${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}: "
    "install clang-22 and clang-tools-22, then configure a new folder with `CXX=clang++-22`.")
endif()
if(NOT CMAKE_CXX_COMPILER_CLANG_SCAN_DEPS)
  message(FATAL_ERROR
    "cilantro consists of C++20 modules, and clang-scan-deps, which finds their order, is missing: "
    "install clang-tools-22, then configure a new folder.")
endif()
