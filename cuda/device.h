// What every kernel stands on: CUDA's own header, or the one that emulates it, and the few things
// that differ between them. No other file asks which it is.
#pragma once

#include <cuda_runtime.h>

#include "core/macros.h"

#include <cstdint>
#include <utility>

#if !defined(__CUDACC__)
#include "emulation/shared_array.h"
#endif

// As PACKET_INLINE, for what only a device can run. A walk's state is in registers only if all that
// touches it is inlined.
#define PACKET_DEVICE __device__ __forceinline__

namespace packet::cuda {

inline constexpr unsigned kWarpSize = 32;
inline constexpr unsigned kFullWarp = 0xFFFFFFFFu;

/// Of a kernel. What it does in one stream is done in order.
struct LaunchShape {
    unsigned blocks, threads;
    std::size_t shared_bytes = 0;
    cudaStream_t stream = nullptr;
};

#if defined(__CUDACC__)

/// An array of words in the block's dynamic shared memory.
template <class T>
class SharedArray {
    static_assert(sizeof(T) == 4);

public:
    PACKET_DEVICE SharedArray(std::uint32_t first_word, std::uint32_t) {
        extern __shared__ std::uint32_t packet_shared_words[];
        first_ = reinterpret_cast<T*>(packet_shared_words + first_word);
    }
    PACKET_DEVICE T& operator[](std::uint32_t i) const { return first_[i]; }
    PACKET_DEVICE void atomic_add(std::uint32_t i, T amount) const {
        atomicAdd(first_ + i, amount);
    }
    PACKET_DEVICE void atomic_min(std::uint32_t i, T value) const { atomicMin(first_ + i, value); }
    PACKET_DEVICE void atomic_max(std::uint32_t i, T value) const { atomicMax(first_ + i, value); }

private:
    T* first_;
};

template <class... Parameters, class... Arguments>
void launch(void (*kernel)(Parameters...), const LaunchShape& shape, Arguments&&... arguments) {
    kernel<<<shape.blocks, shape.threads, shape.shared_bytes, shape.stream>>>(
        std::forward<Arguments>(arguments)...);
}

#else

template <class... Parameters, class... Arguments>
void launch(void (*kernel)(Parameters...), const LaunchShape& shape,
            const Arguments&... arguments) {
    emulation::run_grid({shape.blocks, shape.threads, shape.shared_bytes},
                        [&] { kernel(arguments...); });
}

#endif

PACKET_DEVICE unsigned lane_id() { return threadIdx.x % kWarpSize; }
PACKET_DEVICE unsigned warp_in_block() { return threadIdx.x / kWarpSize; }
/// The lanes below this one.
PACKET_DEVICE unsigned lanes_below() { return (1u << lane_id()) - 1; }
PACKET_DEVICE unsigned thread_in_grid() { return blockIdx.x * blockDim.x + threadIdx.x; }

}  // namespace packet::cuda
