// What CUB does on a device, for ../radix_sort.h.
#include "../radix_sort.h"

#include <algorithm>
#include <numeric>
#include <vector>

namespace packet::cuda {

template <class Key>
static SortedPairs<Key> sort(const SortedPairs<Key>& pairs, int bits) {
    const std::size_t count = pairs.keys.size();
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    const int dropped = static_cast<int>(8 * sizeof(Key)) - bits;
    const auto key = [&](std::size_t i) {
        return static_cast<Key>(pairs.keys.data()[i] << dropped);
    };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
    SortedPairs<Key> sorted{DeviceArray<Key>(count), DeviceArray<std::uint32_t>(count)};
    for (std::size_t i = 0; i < count; ++i) {
        sorted.keys.data()[i] = pairs.keys.data()[order[i]];
        sorted.values.data()[i] = pairs.values.data()[order[i]];
    }
    return sorted;
}

SortedPairs<std::uint32_t> radix_sort(SortedPairs<std::uint32_t> pairs, int bits, cudaStream_t) {
    return sort(pairs, bits);
}
SortedPairs<std::uint64_t> radix_sort(SortedPairs<std::uint64_t> pairs, int bits, cudaStream_t) {
    return sort(pairs, bits);
}

}  // namespace packet::cuda
