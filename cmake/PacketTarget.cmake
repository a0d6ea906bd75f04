# What every target of the project is compiled with.
#
# -ffp-contract=off: a compiler may otherwise fuse a product and a sum into one rounding, where the
# target has such an instruction, and the same ray would then hit differently on another CPU.
function(packet_target name)
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_compile_options(${name} PRIVATE -ffp-contract=off)
  if(PACKET_WARNINGS)
    target_compile_options(${name} PRIVATE
      -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror)
  endif()
  if(PACKET_LINT)
    set_target_properties(${name} PROPERTIES CXX_CLANG_TIDY "clang-tidy;--quiet")
  endif()
endfunction()

set(packet_flags_scalar "")
set(packet_flags_sse42 -msse4.2 -mpopcnt)
set(packet_flags_avx2 ${packet_flags_sse42} -mavx2 -mfma -mbmi -mbmi2)
set(packet_flags_avx512 ${packet_flags_avx2}
    -mavx512f -mavx512cd -mavx512dq -mavx512vl -mavx512bw)

# Compiles a target of kernels for one instruction set.
#
# The definition renames xsimd's namespace. Its inline functions have the same names whatever they
# are compiled for, so at link the AVX-512 copy of one could replace the AVX2 copy.
#
# -Wno-uninitialized: GCC 12 warns of its own AVX-512 header (its bug 105593).
function(packet_isa_target name isa)
  packet_target(${name})
  target_compile_definitions(${name} PRIVATE xsimd=xsimd_${isa})
  target_compile_options(${name} PRIVATE ${packet_flags_${isa}})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${name} PRIVATE -Wno-uninitialized -Wno-maybe-uninitialized)
  endif()
  target_include_directories(${name} SYSTEM PRIVATE
    $<TARGET_PROPERTY:xsimd,INTERFACE_INCLUDE_DIRECTORIES>)
endfunction()
