// Rays whose directions share octant and longest axis can walk in one beam: a class. Where the rays
// of a tile are of a few classes, as shadow rays to a light between them are, they are sorted.
#pragma once

#include "core/direction_class.h"
#include "kernels/lanes.h"

namespace packet {

/// Rays of more classes than this are bounced ones, whose beams would be wide: it does not pay to
/// sort them.
inline constexpr int kMostClasses = 4;

/// Whether rays are of one class, as their directions' columns say. Lanes from `count` on are
/// ignored.
template <int N, class Isa>
PACKET_INLINE bool share_class(const float* const* dir, int count) {
    using F = Float<N, Isa>;
    using M = Mask<N, Isa>;
    constexpr std::uint32_t kAll = static_cast<std::uint32_t>((std::uint64_t{1} << N) - 1);
    constexpr int kTraits = 5;  // that make a class: three signs, and which axis is longest
    std::uint32_t some_have = 0, some_lack = 0;
    for (int first = 0; first < count; first += N) {
        const std::uint32_t used = count - first < N ? (1u << (count - first)) - 1 : kAll;
        const F x = F::load(dir[0] + first), y = F::load(dir[1] + first),
                z = F::load(dir[2] + first);
        const F size_x = abs(x), size_y = abs(y), size_z = abs(z), zero(0.0f);
        const M x_is_longest = (size_y <= size_x) & (size_z <= size_x);
        const M traits[kTraits] = {x < zero, y < zero, z < zero, x_is_longest,
                                   x_is_longest | (size_z <= size_y)};
        for (int i = 0; i < kTraits; ++i) {
            const std::uint32_t bits = traits[i].bits() & used;
            some_have |= (bits != 0 ? 1u : 0u) << i;
            some_lack |= (bits != used ? 1u : 0u) << i;
        }
    }
    return (some_have & some_lack) == 0;
}

/// Rays sorted by class: those of class c are ray[begin[c]] to ray[begin[c + 1]], in order.
template <int kMostRays>
struct ClassRuns {
    std::uint8_t ray[kMostRays];
    int begin[kDirectionClasses + 1] = {};
    int used = 0;  ///< classes that have a ray

    static_assert(kMostRays <= 256);

    PACKET_INLINE ClassRuns(const float* const* dir, int count) {
        std::uint8_t which[kMostRays];
        for (int i = 0; i < count; ++i) {
            which[i] = static_cast<std::uint8_t>(direction_class(dir[0][i], dir[1][i], dir[2][i]));
            ++begin[which[i]];
        }
        for (int c = 0; c <= kDirectionClasses; ++c) {
            used += begin[c] != 0 ? 1 : 0;
            if (c != 0) begin[c] += begin[c - 1];  // for now, where the class ends
        }
        for (int i = count; i-- > 0;) ray[--begin[which[i]]] = static_cast<std::uint8_t>(i);
    }
};

}  // namespace packet
