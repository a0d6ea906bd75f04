#include "radix_sort.h"

#include <cub/device/device_radix_sort.cuh>

namespace packet::cuda {

template <class Key>
static SortedPairs<Key> sort(SortedPairs<Key> pairs, int bits, cudaStream_t stream) {
    const auto count = static_cast<std::int64_t>(pairs.keys.size());
    SortedPairs<Key> sorted{DeviceArray<Key>(pairs.keys.size()),
                            DeviceArray<std::uint32_t>(pairs.keys.size())};
    // Called twice, as all of CUB: first it only says how much memory it wants.
    DeviceArray<unsigned char> scratch;
    std::size_t bytes = 0;
    for (const bool measures : {true, false}) {
        check(cub::DeviceRadixSort::SortPairs(scratch.data(), bytes, pairs.keys.data(),
                                              sorted.keys.data(), pairs.values.data(),
                                              sorted.values.data(), count, 0, bits, stream),
              "radix sort");
        if (measures) scratch = DeviceArray<unsigned char>(bytes == 0 ? 1 : bytes);
    }
    check(cudaStreamSynchronize(stream), "radix sort");  // before the memory is given back
    return sorted;
}

SortedPairs<std::uint32_t> radix_sort(SortedPairs<std::uint32_t> pairs, int bits,
                                      cudaStream_t stream) {
    return sort(std::move(pairs), bits, stream);
}
SortedPairs<std::uint64_t> radix_sort(SortedPairs<std::uint64_t> pairs, int bits,
                                      cudaStream_t stream) {
    return sort(std::move(pairs), bits, stream);
}

}  // namespace packet::cuda
