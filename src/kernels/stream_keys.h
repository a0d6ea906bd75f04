// Finds what rays are sorted by to become streams (core/stream_key.h), eight at a time.
#pragma once

#include "core/stream_key.h"
#include "kernels/direction_class.h"
#include "kernels/trace_batch.h"

namespace packet {

/// `bit` in the lanes of `m`.
template <int N, class Isa>
PACKET_INLINE Int<N, Isa> bit_where(Mask<N, Isa> m, int bit) {
    return select(m, Int<N, Isa>(1 << bit), Int<N, Isa>(0));
}

/// Four times the octant, and which axis is longest.
template <int N, class Isa>
PACKET_INLINE Int<N, Isa> class_bits(const Float<N, Isa> (&dir)[3], int shift) {
    const auto x = abs(dir[0]), y = abs(dir[1]), z = abs(dir[2]);
    const auto x_is_longest = (x >= y) & (x >= z);
    const auto y_is_longest = ~x_is_longest & (y >= z);
    auto out =
        bit_where(y_is_longest, shift) | bit_where(~(x_is_longest | y_is_longest), shift + 1);
    for (int a = 0; a < 3; ++a) out = out | bit_where(are_negative(dir[a]), shift + 2 + a);
    return out;
}

/// Where on the curve. Each bit of a cell's number is found by halving what is left, and all are
/// set beyond the last cell, none before the first or for NaN.
template <int N, class Isa>
PACKET_INLINE Int<N, Isa> place_bits(const Float<N, Isa> (&org)[3], const OriginCells& cells) {
    using F = Float<N, Isa>;
    Int<N, Isa> out(0);
    for (int a = 0; a < 3; ++a) {
        F rest = (org[a] - F(cells.lower[a])) * F(cells.scale);
        for (int bit = kOriginCellBits - 1; bit >= 0; --bit) {
            const F half(static_cast<float>(1 << bit));
            const auto is_beyond = half <= rest;
            rest = rest - select(is_beyond, half, F(0.0f));
            out = out | bit_where(is_beyond, 3 * bit + 2 - a);
        }
    }
    return out;
}

template <class Isa>
void find_stream_keys(const Ray* rays, std::size_t count, const OriginCells& cells,
                      std::uint32_t* keys) noexcept {
    constexpr int N = 8;
    constexpr std::size_t kAhead = 256;  // rays
    using F = Float<N, Isa>;
    const TraceBatch batch{nullptr, rays, nullptr, count, nullptr, nullptr, nullptr};
    RayArrays<N, Isa> arrays = {};
    for (std::size_t begin = 0; begin < count; begin += N) {
        const int lanes = count - begin < N ? static_cast<int>(count - begin) : N;
        const RayColumns columns = gather_rays(batch, begin, lanes, arrays);
        if (begin + kAhead + N <= count) {  // two rays to a line
            for (int i = 0; i < N; i += 2) __builtin_prefetch(rays + begin + kAhead + i);
        }
        F org[3], dir[3];
        for (int a = 0; a < 3; ++a) {
            org[a] = F::load(columns.component[a]);
            dir[a] = F::load(columns.component[4 + a]);
        }
        const auto key = class_bits(dir, kStreamPlaceBits) | place_bits(org, cells);
        std::int32_t out[N];
        key.store(out);
        for (int i = 0; i < lanes; ++i)
            keys[begin + static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(out[i]);
    }
}

}  // namespace packet
