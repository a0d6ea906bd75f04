// Triangle-box overlap by separating axes: the two are apart if and only if their shadows are apart
// on one of 13 axes: the box's three normals (that is the clamping in triangle_box.h), the
// triangle's normal, and the cross products of the box's edges with the triangle's.
//
// Akenine-Moller. Fast 3D triangle-box overlap testing. Journal of Graphics Tools 2001.
#pragma once

#include "kernels/triangle_box.h"

namespace packet {

/// What the axes tell: `apart` on one of them for sure, or `near` enough on one to be so.
template <int N, class Isa>
struct AxisVerdict {
    Mask<N, Isa> apart, near;
};

/// A box's shadow has its middle `distance` from that of the triangle's shadow. They are apart if
/// distance > radius + reach, half the length of one shadow and of the other.
template <int N, class Isa>
PACKET_INLINE void compare_shadows(const Float<N, Isa>& distance, const Float<N, Isa>& radius,
                                   float reach, float error, AxisVerdict<N, Isa>& verdict) {
    const Float<N, Isa> gap = abs(distance) - radius;
    verdict.apart = verdict.apart | (gap > Float<N, Isa>(reach + error));
    verdict.near = verdict.near | (gap > Float<N, Isa>(reach - error));
}

/// Axis x edge, for each axis of the box. `middle` is the middle of the triangle's shadow, whose
/// ends are the edge, seen as a point, and the third corner.
///
/// The error is in units of s = |e_b| side_c + |e_c| side_b. The triangle's shadow is off by 6 u
/// (2 u for either edge in it, 1 u for the product, 1 u for the sum), the box's middle by
/// 2 + 3 + 1 + 1 u (edge, centre, product, sum), its radius by 1 + 2.5 + 0.5 + 1 u, for half <=
/// 1/2. Then three roundings: of distance and gap, at most 1.5 s, and of reach + error: 22 u in
/// all.
template <int N, class Isa>
PACKET_INLINE void compare_along_edge(const OverlapTriangle& triangle,
                                      const ScaledBoxes<N, Isa>& boxes, int k,
                                      const float (&middle)[3], AxisVerdict<N, Isa>& verdict) {
    using F = Float<N, Isa>;
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        const float edge_b = triangle.edge[k][b], edge_c = triangle.edge[k][c];
        const float size_b = __builtin_fabsf(edge_b), size_c = __builtin_fabsf(edge_c);
        const F distance = F(edge_b) * boxes.center[c] - F(edge_c) * boxes.center[b] - F(middle[a]);
        const F radius = F(size_b) * boxes.half[c] + F(size_c) * boxes.half[b];
        const float error = kOverlapError * (size_b * triangle.side[c] + size_c * triangle.side[b]);
        compare_shadows(distance, radius, __builtin_fabsf(middle[a]), error, verdict);
    }
}

template <int N, class Isa>
PACKET_INLINE FilteredOverlaps<N, Isa> filter_by_axes(const OverlapTriangle& triangle,
                                                      const float (&corner0)[3],
                                                      const ClampedBoxes<N, Isa>& clamped) {
    const ScaledBoxes<N, Isa> boxes = scale_boxes(triangle, corner0, clamped);
    const PlaneOffsets<N, Isa> plane = plane_offsets(triangle, boxes);
    AxisVerdict<N, Isa> verdict = {~clamped.meet, ~clamped.meet};
    compare_shadows(plane.distance, plane.radius, 0.0f, plane.error, verdict);
    // Seen along an axis, an edge through corner 0, the origin, is at 0 and the third corner at
    // twice the area. Edge 1 is opposite: it is at minus that, the third corner at 0. The area is
    // computed from the edge itself, for its error must be small where the edge is.
    float middle[3][3];
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        const float area =
            triangle.edge[0][b] * triangle.edge[1][c] - triangle.edge[0][c] * triangle.edge[1][b];
        middle[0][a] = 0.5f * area;
        middle[1][a] = -0.5f * area;
        middle[2][a] = 0.5f * triangle.normal[a];
    }
    for (int k = 0; k < 3; ++k) compare_along_edge(triangle, boxes, k, middle[k], verdict);
    return {(~verdict.near).bits(), (verdict.near & ~verdict.apart).bits()};
}

/// Which of the first `count` boxes, 1 to kMost, overlap the triangle. Bit i is box i.
template <int N, class Isa, int kMost>
std::uint32_t overlap_axes(const float (&triangle)[3][3], const float (&lower)[3][kMost],
                           const float (&upper)[3][kMost], int count) noexcept {
    return find_overlaps<N, Isa>(
        triangle, lower, upper, count,
        [&](const OverlapTriangle& prepared, const ClampedBoxes<N, Isa>& boxes) {
            return filter_by_axes(prepared, triangle[0], boxes);
        });
}

}  // namespace packet
