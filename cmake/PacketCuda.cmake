# Looks for the CUDA Toolkit. PACKET_NVCC is its compiler, or false.
#
# PACKET_CUDA: AUTO takes the toolkit if there is one, ON demands it, OFF leaves it alone.
set(PACKET_CUDA AUTO CACHE STRING "Build for CUDA devices: AUTO, ON or OFF")
set_property(CACHE PACKET_CUDA PROPERTY STRINGS AUTO ON OFF)

if(PACKET_CUDA STREQUAL "OFF")
  set(PACKET_NVCC "")
else()
  # On the PATH, or where the toolkit puts itself.
  find_program(PACKET_NVCC nvcc HINTS ENV CUDA_PATH PATHS /usr/local/cuda/bin)
endif()
if(PACKET_NVCC)
  # C++20 came with CUDA 12; Debian 12 has 11.8.
  execute_process(COMMAND ${PACKET_NVCC} --version OUTPUT_VARIABLE nvcc_version)
  string(REGEX MATCH "release ([0-9.]+)" nvcc_version "${nvcc_version}")
  if(CMAKE_MATCH_1 VERSION_LESS 12)
    message(STATUS "${PACKET_NVCC} is of CUDA ${CMAKE_MATCH_1}; 12 is needed")
    set(PACKET_NVCC "")
  endif()
endif()
if(PACKET_NVCC)
  set(CMAKE_CUDA_COMPILER ${PACKET_NVCC})
  if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
    # Turing is the oldest that CUDA 13 knows; then Hopper, and the newest this toolkit does.
    execute_process(COMMAND ${PACKET_NVCC} --list-gpu-arch OUTPUT_VARIABLE architectures)
    string(REGEX MATCHALL "[0-9]+" architectures "${architectures}")
    list(SORT architectures COMPARE NATURAL ORDER DESCENDING)
    list(GET architectures 0 newest)
    set(CMAKE_CUDA_ARCHITECTURES 75-real 90-real ${newest})
  endif()
  enable_language(CUDA)
  # CMake 3.25 does not know how nvcc is asked for C++20.
  set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION -std=c++20)
  set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION -std=c++20)
elseif(PACKET_CUDA STREQUAL "ON")
  message(FATAL_ERROR "PACKET_CUDA is ON, but there is no nvcc of CUDA 12 or later on the PATH or in /usr/local/cuda")
else()
  message(STATUS "no CUDA Toolkit: packet is built without it")
endif()
