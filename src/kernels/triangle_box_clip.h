// Triangle-box overlap by clipping. Outcodes tell for each corner of the triangle beyond which of
// the box's six faces it lies. No code: the corner is in the box. A bit that all share: apart. Else
// each edge is clipped at the faces that its outcodes name; if a piece is left, the edge enters the
// box. If none does, the box can only meet the triangle's inside, and then the diagonal of the box
// that is most along the triangle's normal passes through it.
//
// Cohen-Sutherland clipping: Newman, Sproull. Principles of Interactive Computer Graphics. 1973.
// Voorhies. Triangle-cube intersection. Graphics Gems III, 1992.
#pragma once

#include "kernels/triangle_box.h"

namespace packet {

/// 16 u for distances along an edge of length 1. Of these each, (face - corner) * (1 / edge), is
/// off by 4 u of itself, and one is compared with another.
inline constexpr float kClipError = 16.0f / 16777216.0f;

/// The outcode of a corner of the triangle, six bits a box.
template <int N, class Isa>
struct Outcode {
    Mask<N, Isa> below[3], above[3];
};

/// Boxes found to overlap for sure, and others that may.
template <int N, class Isa>
struct ClipVerdict {
    Mask<N, Isa> overlap, unsure;
};

template <int N, class Isa>
PACKET_INLINE Outcode<N, Isa> find_outcode(const float (&corner)[3],
                                           const ClampedBoxes<N, Isa>& boxes) {
    Outcode<N, Isa> out;
    for (int a = 0; a < 3; ++a) {
        out.below[a] = Float<N, Isa>(corner[a]) < boxes.lower[a];
        out.above[a] = Float<N, Isa>(corner[a]) > boxes.upper[a];
    }
    return out;
}

/// The boxes that the corner with this code is in.
template <int N, class Isa>
PACKET_INLINE Mask<N, Isa> inside(const Outcode<N, Isa>& code) {
    return ~(code.below[0] | code.above[0] | code.below[1] | code.above[1] | code.below[2] |
             code.above[2]);
}

/// Clips the edge from p to q at the faces that lie between it and the boxes.
template <int N, class Isa>
PACKET_INLINE void clip_edge(const float (&p)[3], const float (&q)[3],
                             const Outcode<N, Isa>& p_code, const Outcode<N, Isa>& q_code,
                             const ClampedBoxes<N, Isa>& boxes, ClipVerdict<N, Isa>& verdict) {
    using F = Float<N, Isa>;
    const F error(kClipError);
    F enter(0.0f), exit(1.0f);
    Mask<N, Isa> beyond = Mask<N, Isa>::from_bits(0);  // both corners, and the same face
    for (int a = 0; a < 3; ++a) {
        // Where p and q are on the same side, or even equal, these mean nothing and are not used.
        const F inverse(1.0f / (q[a] - p[a]));
        const F at_lower = (boxes.lower[a] - F(p[a])) * inverse;
        const F at_upper = (boxes.upper[a] - F(p[a])) * inverse;
        // if (p is below) enter at the lower face; if (q is below) exit there; above likewise
        enter = max(enter,
                    select(p_code.below[a], at_lower, select(p_code.above[a], at_upper, F(0.0f))));
        exit = min(exit,
                   select(q_code.below[a], at_lower, select(q_code.above[a], at_upper, F(1.0f))));
        beyond = beyond | (p_code.below[a] & q_code.below[a]) | (p_code.above[a] & q_code.above[a]);
    }
    verdict.overlap = verdict.overlap | (~beyond & (enter <= exit - error));
    verdict.unsure = verdict.unsure | (~beyond & (enter <= exit + error));
}

/// The axis along which the triangle shows the largest area.
PACKET_INLINE int widest_axis(const float (&normal)[3]) {
    const float x = __builtin_fabsf(normal[0]), y = __builtin_fabsf(normal[1]);
    const float z = __builtin_fabsf(normal[2]);
    return x >= y && x >= z ? 0 : (y >= z ? 1 : 2);
}

/// Where the boxes' diagonals along the normal pass through the plane, seen along `axis`, in or out
/// of the triangle. `unsure` are the boxes for which rounding may tell.
///
/// The diagonal's point is center - ratio * half with signs, ratio = distance / radius. Along an
/// axis it is off by 3 + 2.5 + 3 u (centre, half, roundings), and by the error of ratio, which is
/// plane.error / radius, times half. Its distance from the edge is then off by 2 u for the corner,
/// 2 u for the edge, and 3 u of rounding: 16 u of |e_b| + |e_c|, and the part of ratio.
template <int N, class Isa>
PACKET_INLINE ClipVerdict<N, Isa> pierce(const OverlapTriangle& triangle,
                                         const ScaledBoxes<N, Isa>& boxes,
                                         const PlaneOffsets<N, Isa>& plane, int axis) {
    using F = Float<N, Isa>;
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    // A radius of 0 has an error of 0: plane and box are flat along the same axis, and any point of
    // the box will do.
    const F inverse = F(1.0f) / max(plane.radius, F(0x1p-120f));
    const F ratio = plane.distance * inverse;
    const F ratio_error = F(plane.error) * inverse;
    const F sign_b(triangle.normal[b] < 0.0f ? -1.0f : 1.0f);
    const F sign_c(triangle.normal[c] < 0.0f ? -1.0f : 1.0f);
    const F point_b = boxes.center[b] - ratio * sign_b * boxes.half[b];
    const F point_c = boxes.center[c] - ratio * sign_c * boxes.half[c];
    const float orientation = triangle.normal[axis] < 0.0f ? -1.0f : 1.0f;
    const float corner_b[3] = {0.0f, triangle.edge[0][b], -triangle.edge[2][b]};
    const float corner_c[3] = {0.0f, triangle.edge[0][c], -triangle.edge[2][c]};
    ClipVerdict<N, Isa> out;
    for (int k = 0; k < 3; ++k) {
        const float edge_b = triangle.edge[k][b], edge_c = triangle.edge[k][c];
        const float size_b = __builtin_fabsf(edge_b), size_c = __builtin_fabsf(edge_c);
        const F inner = F(orientation * edge_b) * (point_c - F(corner_c[k])) -
                        F(orientation * edge_c) * (point_b - F(corner_b[k]));
        const F error = F(kOverlapError * (size_b + size_c)) +
                        ratio_error * (F(size_b) * boxes.half[c] + F(size_c) * boxes.half[b]);
        const Mask<N, Isa> in = inner > error, not_out = inner >= F(0.0f) - error;
        out.overlap = k == 0 ? in : out.overlap & in;
        out.unsure = k == 0 ? not_out : out.unsure & not_out;
    }
    return out;
}

/// Adds the boxes that meet the triangle's inside.
template <int N, class Isa>
PACKET_INLINE void meet_inside(const OverlapTriangle& triangle, const float (&corner0)[3],
                               const ClampedBoxes<N, Isa>& clamped, ClipVerdict<N, Isa>& verdict) {
    using F = Float<N, Isa>;
    const ScaledBoxes<N, Isa> boxes = scale_boxes(triangle, corner0, clamped);
    const PlaneOffsets<N, Isa> plane = plane_offsets(triangle, boxes);
    const F gap = abs(plane.distance) - plane.radius;
    const Mask<N, Isa> crossed = gap <= F(-plane.error), missed = gap > F(plane.error);
    const int axis = widest_axis(triangle.normal);
    // Of a triangle too thin to tell which side of its edges is the inner one, nothing is sure.
    if (__builtin_fabsf(triangle.normal[axis]) <= kOverlapError * triangle.magnitude[axis]) {
        verdict.unsure = verdict.unsure | ~missed;
        return;
    }
    const ClipVerdict<N, Isa> point = pierce(triangle, boxes, plane, axis);
    verdict.overlap = verdict.overlap | (crossed & point.overlap);
    // if (the plane misses the box, or cuts it outside the triangle) the edges' verdict stands
    verdict.unsure = verdict.unsure | ~(missed | (crossed & ~point.unsure));
}

template <int N, class Isa>
PACKET_INLINE FilteredOverlaps<N, Isa> filter_by_clipping(const OverlapTriangle& triangle,
                                                          const float (&v)[3][3],
                                                          const ClampedBoxes<N, Isa>& boxes) {
    const Outcode<N, Isa> code[3] = {find_outcode(v[0], boxes), find_outcode(v[1], boxes),
                                     find_outcode(v[2], boxes)};
    ClipVerdict<N, Isa> verdict = {inside(code[0]) | inside(code[1]) | inside(code[2]),
                                   Mask<N, Isa>::from_bits(0)};
    for (int k = 0; k < 3; ++k) {
        const int next = (k + 1) % 3;
        clip_edge(v[k], v[next], code[k], code[next], boxes, verdict);
    }
    if (any(boxes.meet & ~verdict.overlap)) meet_inside(triangle, v[0], boxes, verdict);
    return {(boxes.meet & verdict.overlap).bits(),
            (boxes.meet & verdict.unsure & ~verdict.overlap).bits()};
}

/// Which of the first `count` boxes, 1 to kMost, overlap the triangle. Bit i is box i.
template <int N, class Isa, int kMost>
std::uint32_t overlap_clip(const float (&triangle)[3][3], const float (&lower)[3][kMost],
                           const float (&upper)[3][kMost], int count) noexcept {
    return find_overlaps<N, Isa>(
        triangle, lower, upper, count,
        [&](const OverlapTriangle& prepared, const ClampedBoxes<N, Isa>& boxes) {
            return filter_by_clipping(prepared, triangle, boxes);
        });
}

}  // namespace packet
