// Launches of kernels that give each item a thread, or a warp.
#pragma once

#include "memory.h"

namespace packet::cuda {

inline constexpr unsigned kItemThreads = 256;  ///< a block

/// Kernels ask thread_in_grid() for their item, and leave it alone if it is `count` or more.
template <class... Parameters, class... Arguments>
void for_each_item(std::size_t count, const Stream& stream, void (*kernel)(Parameters...),
                   Arguments... arguments) {
    if (count == 0) return;
    const auto blocks = static_cast<unsigned>((count + kItemThreads - 1) / kItemThreads);
    launch(kernel, {blocks, kItemThreads, 0, stream.get()}, arguments...);
    check(cudaGetLastError(), "launch of a kernel that builds");
}

/// As for_each_item, with a warp an item: warp_in_grid().
template <class... Parameters, class... Arguments>
void for_each_warp(std::size_t count, const Stream& stream, void (*kernel)(Parameters...),
                   Arguments... arguments) {
    for_each_item(count * kWarpSize, stream, kernel, arguments...);
}
PACKET_DEVICE unsigned warp_in_grid() { return thread_in_grid() / kWarpSize; }

}  // namespace packet::cuda
