// The triangle-box overlap tests for one box at a time. Builders that test several at once take
// them from the KernelTable; the answers are the same.
#pragma once

#include "kernels/triangle_box_axes.h"
#include "kernels/triangle_box_clip.h"

#include <packet/bounds.h>

namespace packet {

/// A triangle and a box as the kernels take them.
struct TriangleAndBox {
    float triangle[3][3], lower[3][1], upper[3][1];

    TriangleAndBox(const glm::vec3 (&v)[3], const Bounds3f& box) noexcept {
        for (int a = 0; a < 3; ++a) {
            for (int k = 0; k < 3; ++k) triangle[k][a] = v[k][a];
            lower[a][0] = box.lower[a];
            upper[a][0] = box.upper[a];
        }
    }
};

/// Whether the triangle and the box, both closed, share a point, by separating axes. Exact. A
/// triangle that is not finite and a box that is empty or has a NaN overlap nothing.
[[nodiscard]] inline bool overlaps_by_axes(const glm::vec3 (&v)[3], const Bounds3f& box) noexcept {
    const TriangleAndBox in(v, box);
    return overlap_axes<1, isa::Scalar>(in.triangle, in.lower, in.upper, 1) != 0;
}

/// The same answer, by clipping.
[[nodiscard]] inline bool overlaps_by_clipping(const glm::vec3 (&v)[3],
                                               const Bounds3f& box) noexcept {
    const TriangleAndBox in(v, box);
    return overlap_clip<1, isa::Scalar>(in.triangle, in.lower, in.upper, 1) != 0;
}

}  // namespace packet
