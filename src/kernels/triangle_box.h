// Does a triangle overlap boxes? What the two tests of it share (triangle_box_axes.h and
// triangle_box_clip.h): one triangle meets N boxes, each box in a lane. Both sets are closed, so to
// touch is to overlap, and the answer is exact for all finite floats: a test decides in float what
// its error bound allows, and leaves the rest to overlaps_exactly().
//
// Two exact steps come first. Boxes are clamped to the triangle's own box, which does not change
// whether they overlap; boxes left empty do not. What remains is then moved and scaled along each
// axis so that the triangle's box becomes the unit cube, which does not change it either. So errors
// are bounded by constants, whatever the size and place of triangle and boxes.
//
// Error bounds are in units of u = 2^-24, the rounding of one operation. Along an axis
//   a length q - p, computed as (q - p) * scale, is off by 2 u of itself,
//   a box's centre, (lower + upper) / 2, is off by 3 u and half its side, (upper - lower) / 2, by
//   2.5 u, for the scaled lower and upper are at most 1 and off by 2 u.
// (The scale itself may be any number, so its rounding is no error.)
#pragma once

#include "kernels/exact_sign.h"
#include "kernels/lanes.h"

namespace packet {

/// Bounds the error of all decisions made in the unit cube: 32 u times the largest terms. Their
/// derivations stand at their uses; they come to 24 u at most, terms in u^2 included.
inline constexpr float kOverlapError = 32.0f / 16777216.0f;

/// A triangle in front of boxes. Edge k leads from corner k to corner (k + 1) % 3.
struct OverlapTriangle {
    float lower[3], upper[3];  ///< its box
    float scale[3];            ///< 1 / the box's side, or 0 if it is flat
    float side[3];             ///< the scaled box's side: 1, or 0 if it is flat
    float edge[3][3];          ///< scaled
    float normal[3];           ///< edge 2 x edge 0
    /// The sums of the magnitudes of the normal's products. The normal is off by 6 u of them: 2 u
    /// for either edge, 1 u for the product, 1 u for the sum.
    float magnitude[3];
    bool is_finite;
    /// False if products of edges might underflow or overflow: then all is decided exactly.
    bool is_tame;
};

/// Boxes clamped to the triangle's.
template <int N, class Isa>
struct ClampedBoxes {
    Float<N, Isa> lower[3], upper[3];
    Mask<N, Isa> meet;  ///< those not empty
};

/// The same, in the unit cube, relative to the triangle's corner 0.
template <int N, class Isa>
struct ScaledBoxes {
    Float<N, Isa> center[3], half[3];
};

/// Zero, or far enough from underflow and overflow of products of three.
PACKET_INLINE bool is_tame(float length, float smallest, float largest) {
    return length == 0.0f || (length >= smallest && length <= largest);
}

PACKET_INLINE OverlapTriangle prepare_triangle(const float (&v)[3][3]) {
    OverlapTriangle out;
    float zero = 0.0f;
    out.is_tame = true;
    for (int a = 0; a < 3; ++a) {
        const float v0 = v[0][a], v1 = v[1][a], v2 = v[2][a];
        const float low = v0 < v1 ? v0 : v1, high = v0 < v1 ? v1 : v0;
        out.lower[a] = v2 < low ? v2 : low;
        out.upper[a] = v2 > high ? v2 : high;
        zero += v0 * 0.0f + v1 * 0.0f + v2 * 0.0f;
        const float side = out.upper[a] - out.lower[a];
        out.is_tame &= is_tame(side, 0x1p-70f, 0x1p100f);
        out.scale[a] = side > 0.0f ? 1.0f / side : 0.0f;
        out.side[a] = side > 0.0f ? 1.0f : 0.0f;
        for (int k = 0; k < 3; ++k) {
            out.edge[k][a] = (v[(k + 1) % 3][a] - v[k][a]) * out.scale[a];
            out.is_tame &= is_tame(__builtin_fabsf(out.edge[k][a]), 0x1p-50f, 2.0f);
        }
    }
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        const float left = out.edge[2][b] * out.edge[0][c];
        const float right = out.edge[2][c] * out.edge[0][b];
        out.normal[a] = left - right;
        out.magnitude[a] = __builtin_fabsf(left) + __builtin_fabsf(right);
    }
    out.is_finite = zero == 0.0f;  // infinity * 0 and NaN * 0 are NaN
    return out;
}

/// N of the boxes, from `first` on.
template <int N, class Isa, int kMost>
PACKET_INLINE ClampedBoxes<N, Isa> clamp_boxes(const OverlapTriangle& triangle,
                                               const float (&lower)[3][kMost],
                                               const float (&upper)[3][kMost], int first) {
    using F = Float<N, Isa>;
    ClampedBoxes<N, Isa> out;
    for (int a = 0; a < 3; ++a) {
        // min and max yield their second operand for NaN: a NaN stays one and the box is empty
        out.lower[a] = max(F(triangle.lower[a]), F::load(lower[a] + first));
        out.upper[a] = min(F(triangle.upper[a]), F::load(upper[a] + first));
        const Mask<N, Isa> meet = out.lower[a] <= out.upper[a];
        out.meet = a == 0 ? meet : out.meet & meet;
    }
    return out;
}

template <int N, class Isa>
PACKET_INLINE ScaledBoxes<N, Isa> scale_boxes(const OverlapTriangle& triangle,
                                              const float (&corner0)[3],
                                              const ClampedBoxes<N, Isa>& boxes) {
    using F = Float<N, Isa>;
    ScaledBoxes<N, Isa> out;
    for (int a = 0; a < 3; ++a) {
        const F origin(corner0[a]), scale(triangle.scale[a]), one_half(0.5f);
        const F lower = (boxes.lower[a] - origin) * scale;
        const F upper = (boxes.upper[a] - origin) * scale;
        out.center[a] = (lower + upper) * one_half;
        out.half[a] = (upper - lower) * one_half;
    }
    return out;
}

/// The triangle's plane before boxes.
template <int N, class Isa>
struct PlaneOffsets {
    Float<N, Isa> distance;  ///< normal . center
    Float<N, Isa> radius;    ///< |normal| . half: how far the box reaches along the normal
    /// Bounds the error of |distance| - radius, in units of the sum of magnitude * side: distance
    /// is off by 6 + 3 + 1 + 2 u (normal, centre, product, sums), radius by 3 + 2.5 + 0.5 + 1 u,
    /// for half <= 1/2, and their difference is rounded by 2 u: 21 u.
    float error;
};

template <int N, class Isa>
PACKET_INLINE PlaneOffsets<N, Isa> plane_offsets(const OverlapTriangle& triangle,
                                                 const ScaledBoxes<N, Isa>& boxes) {
    using F = Float<N, Isa>;
    PlaneOffsets<N, Isa> out = {F(0.0f), F(0.0f), 0.0f};
    for (int a = 0; a < 3; ++a) {
        const F normal(triangle.normal[a]);
        out.distance = out.distance + normal * boxes.center[a];
        out.radius = out.radius + abs(normal) * boxes.half[a];
        out.error += triangle.magnitude[a] * triangle.side[a];
    }
    out.error *= kOverlapError;
    return out;
}

/// Whether the plane of the triangle v passes the box without touching it.
template <class Isa>
PACKET_INLINE bool plane_misses(const float (&v)[3][3], const int (&normal_sign)[3],
                                const float (&lower)[3], const float (&upper)[3]) {
    float near[3], far[3];
    for (int a = 0; a < 3; ++a) {
        near[a] = normal_sign[a] > 0 ? lower[a] : upper[a];
        far[a] = normal_sign[a] > 0 ? upper[a] : lower[a];
    }
    return side_of_plane<Isa>(v[0], v[1], v[2], near) > 0 ||
           side_of_plane<Isa>(v[0], v[1], v[2], far) < 0;
}

/// Whether the box, seen along axis `a`, lies beyond one of the triangle's edges. A triangle seen
/// from the side is a line, which has edges in both directions and so two outer sides.
template <class Isa>
PACKET_INLINE bool edge_parts(const float (&v)[3][3], int a, int area_sign, const float (&lower)[3],
                              const float (&upper)[3]) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    for (int k = 0; k < 3; ++k) {
        // The edge with the triangle on its left, and the corner of the box farthest to its left.
        const float(&from)[3] = v[area_sign < 0 ? (k + 1) % 3 : k];
        const float(&to)[3] = v[area_sign < 0 ? k : (k + 1) % 3];
        const float p[2] = {from[b], from[c]}, q[2] = {to[b], to[c]};
        const float left[2] = {q[1] < p[1] ? upper[b] : lower[b],
                               q[0] > p[0] ? upper[c] : lower[c]};
        if (side_of_line<Isa>(p, q, left) < 0) return true;
    }
    return false;
}

/// The exact answer, for any finite triangle, degenerate ones too, and a box that meets the
/// triangle's own box. By separating axes: two convex polytopes are apart if and only if a plane
/// along a face of either, or along an edge of each, has them on different sides. Where that plane
/// runs along an edge of the triangle, the third corner is on the triangle's side.
template <class Isa>
[[gnu::noinline]] bool overlaps_exactly(const float (&v)[3][3], const float (&lower)[3],
                                        const float (&upper)[3]) {
    int area_sign[3];  // of the triangle seen along an axis: the sign of its normal
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        const float p[2] = {v[0][b], v[0][c]}, q[2] = {v[1][b], v[1][c]}, r[2] = {v[2][b], v[2][c]};
        area_sign[a] = side_of_line<Isa>(p, q, r);
    }
    for (int a = 0; a < 3; ++a) {
        if (edge_parts<Isa>(v, a, area_sign[a], lower, upper)) return false;
    }
    return !plane_misses<Isa>(v, area_sign, lower, upper);
}

/// The boxes among `bits` that overlap, by the exact answer for each.
template <int N, class Isa>
[[gnu::noinline]] std::uint32_t decide_overlaps(const float (&triangle)[3][3],
                                                const ClampedBoxes<N, Isa>& boxes,
                                                std::uint32_t bits) {
    float lower[3][N], upper[3][N];
    for (int a = 0; a < 3; ++a) {
        boxes.lower[a].store(lower[a]);
        boxes.upper[a].store(upper[a]);
    }
    std::uint32_t overlap = 0;
    for (; bits != 0; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        const float low[3] = {lower[0][i], lower[1][i], lower[2][i]};
        const float high[3] = {upper[0][i], upper[1][i], upper[2][i]};
        if (overlaps_exactly<Isa>(triangle, low, high)) overlap |= 1u << i;
    }
    return overlap;
}

/// What a filter found: boxes that overlap for sure, and others that may.
template <int N, class Isa>
struct FilteredOverlaps {
    std::uint32_t overlap, undecided;
};

/// The frame of both tests, of the first `count` boxes. `filter(prepared, boxes)` sorts N boxes
/// into those that overlap for sure and those that may; the latter are decided exactly. No box
/// overlaps a triangle that is not finite, and nothing overlaps a box with a NaN or with lower >
/// upper.
template <int N, class Isa, int kMost, class Filter>
PACKET_INLINE std::uint32_t find_overlaps(const float (&triangle)[3][3],
                                          const float (&lower)[3][kMost],
                                          const float (&upper)[3][kMost], int count,
                                          Filter filter) {
    static_assert(kMost % N == 0 && kMost <= 32);
    const OverlapTriangle prepared = prepare_triangle(triangle);
    if (!prepared.is_finite) return 0;
    std::uint32_t overlap = 0;
    for (int first = 0; first < count; first += N) {
        const ClampedBoxes<N, Isa> boxes = clamp_boxes<N, Isa>(prepared, lower, upper, first);
        const std::uint32_t meet = boxes.meet.bits();
        if (meet == 0) continue;
        FilteredOverlaps<N, Isa> found = {0, meet};
        if (prepared.is_tame) [[likely]]
            found = filter(prepared, boxes);
        if (found.undecided != 0) [[unlikely]]
            found.overlap |= decide_overlaps(triangle, boxes, found.undecided);
        overlap |= found.overlap << first;
    }
    return overlap & (0xffffffffu >> (32 - count));
}

}  // namespace packet
