// Stands in for the CUDA Toolkit's header of this name, so that a C++ compiler takes the kernels'
// sources as they are: as much of CUDA as they use, run by grid.h. Memory of the device is memory.
#pragma once

#include "grid.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#define __global__
#define __device__
#define __host__
#define __forceinline__ inline
#define __launch_bounds__(...)

struct uint3 {
    unsigned x, y, z;
};
using dim3 = uint3;
struct alignas(16) float4 {
    float x, y, z, w;
};
struct alignas(16) uint4 {
    unsigned x, y, z, w;
};

// Those of the thread that runs.
inline uint3 threadIdx = {}, blockIdx = {};
inline dim3 blockDim = {}, gridDim = {};

// ---- Intrinsics ----

inline constexpr int warpSize = 32;

inline unsigned __ballot_sync(unsigned mask, int vote) {
    using namespace packet::emulation;
    return static_cast<unsigned>(meet(Operation::kBallot, mask, vote != 0));
}
inline int __any_sync(unsigned mask, int vote) {
    using namespace packet::emulation;
    return meet(Operation::kAny, mask, vote != 0) != 0;
}
inline int __all_sync(unsigned mask, int vote) {
    using namespace packet::emulation;
    return meet(Operation::kAll, mask, vote != 0) != 0;
}
template <class T>
T __shfl_sync(unsigned mask, T value, int lane) {
    using namespace packet::emulation;
    const auto source = static_cast<unsigned>(lane) % 32;
    if constexpr (sizeof(T) == 8) {
        return std::bit_cast<T>(
            meet(Operation::kShuffle, mask, std::bit_cast<std::uint64_t>(value), source));
    } else {
        static_assert(sizeof(T) == 4);
        return std::bit_cast<T>(static_cast<std::uint32_t>(
            meet(Operation::kShuffle, mask, std::bit_cast<std::uint32_t>(value), source)));
    }
}
/// That of the lane so many below; a lane's own where there is none.
template <class T>
T __shfl_up_sync(unsigned mask, T value, unsigned lanes) {
    const unsigned lane = threadIdx.x % 32;
    return __shfl_sync(mask, value, static_cast<int>(lane < lanes ? lane : lane - lanes));
}
template <class T>
T __shfl_xor_sync(unsigned mask, T value, int bits) {
    return __shfl_sync(mask, value, static_cast<int>(threadIdx.x % 32) ^ bits);
}
inline void __syncwarp(unsigned mask = 0xFFFFFFFFu) {
    using namespace packet::emulation;
    (void)meet(Operation::kSyncWarp, mask);
}
inline void __syncthreads() { packet::emulation::sync_threads(); }
inline void __threadfence() {}

template <class T, class U>
T atomicAdd(T* to, U amount) {
    packet::emulation::yield();
    const T old = *to;
    *to = static_cast<T>(old + static_cast<T>(amount));
    return old;
}
template <class T>
T atomicMin(T* to, T value) {
    packet::emulation::yield();
    const T old = *to;
    if (value < old) *to = value;
    return old;
}
template <class T>
T atomicMax(T* to, T value) {
    packet::emulation::yield();
    const T old = *to;
    if (old < value) *to = value;
    return old;
}
template <class T>
T atomicExch(T* to, T value) {
    packet::emulation::yield();
    const T old = *to;
    *to = value;
    return old;
}

template <class T>
T atomicOr(T* to, T bits) {
    packet::emulation::yield();
    const T old = *to;
    *to = old | bits;
    return old;
}

inline int __clz(int x) { return std::countl_zero(static_cast<unsigned>(x)); }
inline int __popc(unsigned x) { return std::popcount(x); }
inline int __ffs(int x) { return __builtin_ffs(x); }
inline float __fmaf_rn(float a, float b, float c) { return std::fma(a, b, c); }
inline int __float_as_int(float x) { return std::bit_cast<int>(x); }
inline unsigned __float_as_uint(float x) { return std::bit_cast<unsigned>(x); }
inline float __uint_as_float(unsigned x) { return std::bit_cast<float>(x); }
inline float __int_as_float(int x) { return std::bit_cast<float>(x); }
template <class T>
T __ldg(const T* from) {
    return *from;
}

// ---- The runtime, of one device that does everything at once ----

enum cudaError_t { cudaSuccess = 0, cudaErrorMemoryAllocation = 2 };
enum cudaMemcpyKind { cudaMemcpyHostToDevice, cudaMemcpyDeviceToHost, cudaMemcpyDeviceToDevice };
enum cudaFuncAttribute { cudaFuncAttributeMaxDynamicSharedMemorySize };
enum cudaDeviceAttr { cudaDevAttrMultiProcessorCount, cudaDevAttrMaxSharedMemoryPerBlockOptin };
using cudaStream_t = struct packet_emulated_stream*;
using cudaEvent_t = struct packet_emulated_event*;
struct cudaDeviceProp {
    char name[64];
};

inline const char* cudaGetErrorString(cudaError_t error) {
    return error == cudaSuccess ? "no error" : "out of memory";
}
inline cudaError_t cudaGetLastError() { return cudaSuccess; }
inline cudaError_t cudaGetDeviceCount(int* count) { return *count = 1, cudaSuccess; }
inline cudaError_t cudaGetDevice(int* device) { return *device = 0, cudaSuccess; }
inline cudaError_t cudaGetDeviceProperties(cudaDeviceProp* out, int) {
    std::strcpy(out->name, "emulation on the CPU");
    return cudaSuccess;
}
inline cudaError_t cudaDeviceGetAttribute(int* out, cudaDeviceAttr which, int) {
    *out = which == cudaDevAttrMultiProcessorCount ? 1 : 64 * 1024;
    return cudaSuccess;
}
template <class Kernel>
cudaError_t cudaOccupancyMaxActiveBlocksPerMultiprocessor(int* blocks, Kernel, int, std::size_t) {
    *blocks = 2;
    return cudaSuccess;
}
template <class Kernel>
cudaError_t cudaFuncSetAttribute(Kernel, cudaFuncAttribute, int) {
    return cudaSuccess;
}
template <class T>
cudaError_t cudaMalloc(T** out, std::size_t bytes) {
    *out = static_cast<T*>(std::aligned_alloc(256, (bytes + 255) / 256 * 256));
    if (*out == nullptr) return cudaErrorMemoryAllocation;
    std::memset(static_cast<void*>(*out), 0xA5, bytes);  // a device's memory is not zero either
    return cudaSuccess;
}
inline cudaError_t cudaFree(void* memory) { return std::free(memory), cudaSuccess; }
inline cudaError_t cudaMemcpyAsync(void* to, const void* from, std::size_t bytes, cudaMemcpyKind,
                                   cudaStream_t) {
    if (bytes != 0) std::memcpy(to, from, bytes);
    return cudaSuccess;
}
inline cudaError_t cudaMemsetAsync(void* to, int byte, std::size_t bytes, cudaStream_t) {
    return std::memset(to, byte, bytes), cudaSuccess;
}
inline cudaError_t cudaStreamCreate(cudaStream_t* out) { return *out = nullptr, cudaSuccess; }
inline cudaError_t cudaStreamDestroy(cudaStream_t) { return cudaSuccess; }
inline cudaError_t cudaStreamSynchronize(cudaStream_t) { return cudaSuccess; }
inline cudaError_t cudaEventCreate(cudaEvent_t* out) { return *out = nullptr, cudaSuccess; }
inline cudaError_t cudaEventDestroy(cudaEvent_t) { return cudaSuccess; }
inline cudaError_t cudaEventRecord(cudaEvent_t, cudaStream_t) { return cudaSuccess; }
inline cudaError_t cudaEventElapsedTime(float* milliseconds, cudaEvent_t, cudaEvent_t) {
    return *milliseconds = 0.0f, cudaSuccess;
}
