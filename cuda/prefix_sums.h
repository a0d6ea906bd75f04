// Sums over all items before each, a thin seam: CUB on a GPU, the standard library where it is
// emulated.
#pragma once

#include "memory.h"

#include <cstdint>

namespace packet::cuda {

/// Fills sums[i] with the sum of values[0] to values[i - 1], up to sums[count], in the stream's
/// order. It keeps its scratch memory from call to call.
class PrefixSums {
public:
    void operator()(const std::uint32_t* values, std::uint32_t* sums, std::size_t count,
                    cudaStream_t stream);
    void operator()(const std::uint64_t* values, std::uint64_t* sums, std::size_t count,
                    cudaStream_t stream);

private:
    DeviceArray<unsigned char> scratch_;
};

/// Two counts that are summed as one: neither sum exceeds 32 bits, so none carries into the other.
struct CountPair {
    std::uint32_t low, high;
};
[[nodiscard]] constexpr std::uint64_t pack(CountPair pair) noexcept {
    return std::uint64_t{pair.high} << 32 | pair.low;
}
[[nodiscard]] constexpr CountPair unpack_counts(std::uint64_t packed) noexcept {
    return {static_cast<std::uint32_t>(packed), static_cast<std::uint32_t>(packed >> 32)};
}

}  // namespace packet::cuda
