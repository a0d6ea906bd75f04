// Sorting on the device, a thin seam: CUB on a GPU, the standard library where it is emulated.
#pragma once

#include "memory.h"

#include <cstdint>

namespace packet::cuda {

/// Keys and what belongs to them, sorted by the keys' low `bits`; equal keys keep their order.
template <class Key>
struct SortedPairs {
    DeviceArray<Key> keys;
    DeviceArray<std::uint32_t> values;
};

/// Done in the stream's order.
[[nodiscard]] SortedPairs<std::uint32_t> radix_sort(SortedPairs<std::uint32_t> pairs, int bits,
                                                    cudaStream_t stream);
[[nodiscard]] SortedPairs<std::uint64_t> radix_sort(SortedPairs<std::uint64_t> pairs, int bits,
                                                    cudaStream_t stream);

}  // namespace packet::cuda
