# The units that are compiled once for each set of vector instructions, of which the library chooses
# at run time. Why: docs/decisions/0017-vector-kernels.md
set(cilantro_vector_kernels "")
foreach(area IN LISTS cilantro_areas components)
  file(GLOB kernels CONFIGURE_DEPENDS modules/${area}/kernels/*.cpp)
  list(APPEND cilantro_vector_kernels ${kernels})
endforeach()

set(cilantro_kernel_objects)
# No fused operations: what is computed must not depend on the machine. Square roots set no errno.
function(cilantro_add_vector_target name)
  add_library(cilantro_${name} OBJECT ${cilantro_vector_kernels})
  target_compile_features(cilantro_${name} PRIVATE cxx_std_20)
  target_compile_definitions(cilantro_${name} PRIVATE CILANTRO_VECTOR_TARGET=${name})
  target_compile_options(cilantro_${name} PRIVATE -ffp-contract=off -fno-math-errno ${ARGN})
  target_include_directories(cilantro_${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/modules)
  set_target_properties(cilantro_${name} PROPERTIES
    CXX_SCAN_FOR_MODULES OFF POSITION_INDEPENDENT_CODE ON)
  list(APPEND cilantro_kernel_objects $<TARGET_OBJECTS:cilantro_${name}>)
  set(cilantro_kernel_objects ${cilantro_kernel_objects} PARENT_SCOPE)
endfunction()

cilantro_add_vector_target(baseline)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  cilantro_add_vector_target(avx2 -mavx2 -mbmi -mbmi2)
  cilantro_add_vector_target(avx512
    -mavx2 -mbmi -mbmi2 -mavx512f -mavx512bw -mavx512dq -mavx512vl -mprefer-vector-width=512)
endif()
