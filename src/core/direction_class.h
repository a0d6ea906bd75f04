// Rays whose directions share octant and longest axis are of one class: they meet the planes of
// boxes in the same order and move triangles along the same axes, so they can walk together. The
// classes of an octant follow each other.
#pragma once

#include "core/macros.h"

namespace packet {

inline constexpr int kDirectionClasses = 24;

/// The class of a direction. -0 counts as negative, as its reciprocal does; what NaN is does not
/// matter, since such rays hit nothing.
PACKET_INLINE int direction_class(float x, float y, float z) {
    const auto negative = [](float a) { return __builtin_signbit(a) != 0 ? 1 : 0; };
    const float size_x = __builtin_fabsf(x), size_y = __builtin_fabsf(y),
                size_z = __builtin_fabsf(z);
    const int octant = negative(x) + 2 * negative(y) + 4 * negative(z);
    // Added up, since rays in no order would make branches of it unpredictable.
    const int x_is_longest =
        static_cast<int>(size_x >= size_y) & static_cast<int>(size_x >= size_z);
    const int y_is_longest = (1 - x_is_longest) & static_cast<int>(size_y >= size_z);
    return 3 * octant + 2 - 2 * x_is_longest - y_is_longest;
}

}  // namespace packet
