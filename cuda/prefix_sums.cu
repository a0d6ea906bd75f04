#include "prefix_sums.h"

#include <cub/device/device_scan.cuh>

namespace packet::cuda {

template <class T>
static void sum(DeviceArray<unsigned char>& scratch, const T* values, T* sums, std::size_t count,
                cudaStream_t stream) {
    check(cudaMemsetAsync(sums, 0, sizeof(T), stream), "cudaMemset");
    const auto items = static_cast<std::int64_t>(count);
    // Called twice, as all of CUB: first it only says how much memory it wants.
    std::size_t bytes = 0;
    check(cub::DeviceScan::InclusiveSum(nullptr, bytes, values, sums + 1, items, stream),
          "prefix sums");
    scratch.make_room(bytes + 1);
    check(cub::DeviceScan::InclusiveSum(scratch.data(), bytes, values, sums + 1, items, stream),
          "prefix sums");
}

void PrefixSums::operator()(const std::uint32_t* values, std::uint32_t* sums, std::size_t count,
                            cudaStream_t stream) {
    sum(scratch_, values, sums, count, stream);
}
void PrefixSums::operator()(const std::uint64_t* values, std::uint64_t* sums, std::size_t count,
                            cudaStream_t stream) {
    sum(scratch_, values, sums, count, stream);
}

}  // namespace packet::cuda
