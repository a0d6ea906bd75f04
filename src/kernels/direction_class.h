// Rays whose directions share octant and longest axis can walk in one beam: a class. Where the rays
// of a tile are of a few classes, as shadow rays to a light between them are, they are sorted.
#pragma once

#include "core/direction_class.h"
#include "core/stream_key.h"
#include "kernels/lanes.h"

namespace packet {

/// A stream's key has room for an octant's classes as four.
static_assert(kDirectionClasses / 3 * 4 <= 1 << (kStreamKeyBits - kStreamPlaceBits));

/// Rays of more classes than this are bounced ones, whose beams would be wide: it does not pay to
/// sort them.
inline constexpr int kMostClasses = 4;

/// -0 counts as negative, as its reciprocal does.
template <int N, class Isa>
PACKET_INLINE Mask<N, Isa> are_negative(const Float<N, Isa>& a) {
    const Float<N, Isa> zero(0.0f);
    const Mask<N, Isa> are_zero = a == zero;
    if (none(are_zero)) return a < zero;
    return (a < zero) | (are_zero & (Float<N, Isa>(1.0f) / a < zero));
}

/// How many rays from the first on are of its class, at most `count` (>= 1), as their directions'
/// columns say, which are to end no sooner than a whole number of N.
template <int N, class Isa>
PACKET_INLINE int class_run(const float* const* dir, int count) {
    using F = Float<N, Isa>;
    constexpr int kTraits = 5;  // that make a class: three signs, and which axis is longest
    std::uint32_t first_has[kTraits] = {};
    for (int first = 0; first < count; first += N) {
        const F x = F::load(dir[0] + first), y = F::load(dir[1] + first),
                z = F::load(dir[2] + first);
        const F size_x = abs(x), size_y = abs(y), size_z = abs(z);
        const auto x_is_longest = (size_y <= size_x) & (size_z <= size_x);
        const std::uint32_t traits[kTraits] = {are_negative(x).bits(), are_negative(y).bits(),
                                               are_negative(z).bits(), x_is_longest.bits(),
                                               (x_is_longest | (size_z <= size_y)).bits()};
        std::uint32_t others = 0;
        for (int i = 0; i < kTraits; ++i) {
            if (first == 0) first_has[i] = 0 - (traits[i] & 1u);
            others |= traits[i] ^ first_has[i];
        }
        others &= static_cast<std::uint32_t>((std::uint64_t{1} << N) - 1);
        if (others != 0) {
            const int run = first + __builtin_ctz(others);
            return run < count ? run : count;
        }
    }
    return count;
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
