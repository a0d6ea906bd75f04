// The watertight triangle test, in the lanes of whoever calls: many rays and one triangle, or one
// ray and many triangles. Three edge functions of the sheared triangle tell on which side of each
// edge the ray passes. Their signs are exact, so two triangles that share an edge never disagree
// about it and no ray slips through between them.
//
// It comes in two steps. may_hit() computes the edge functions in float, where rounding may turn a
// sign to zero but never over: it rejects nothing that hits, and nearly all that does not.
// decide_hits() settles the few lanes that are left.
//
// Woop, Benthin, Wald. Watertight ray/triangle intersection. JCGT 2013.
#pragma once

#include "kernels/box.h"
#include "kernels/ray_setup.h"

namespace packet {

/// Edge functions: twice the signed areas that the ray spans with the edge opposite to a corner.
template <int N, class Isa>
struct Edges {
    Float<N, Isa> u, v, w;
};

template <int N, class Isa>
struct TriangleHits {
    Mask<N, Isa> hit;
    Float<N, Isa> t, u, v;
};

/// a * b - c * d with the sign that it would have without rounding. The products are exact in
/// double, their difference keeps its sign, and so does the cast: what would underflow stays the
/// smallest float.
PACKET_INLINE float exact_sign_difference(float a, float b, float c, float d) {
    const double exact = static_cast<double>(a) * b - static_cast<double>(c) * d;
    const float rounded = static_cast<float>(exact);
    if (rounded != 0.0f || exact == 0.0) return rounded;
    constexpr float kSmallest = 1.401298464e-45f;
    return exact > 0.0 ? kSmallest : -kSmallest;
}

/// Recomputes the edge functions of the lanes in `bits` so that zero means zero. Rare: rays that
/// pass an edge or a corner as closely as float can tell.
template <int N, class Isa>
[[gnu::noinline]] void decide_edges(const Float3<N, Isa> (&p)[3], std::uint32_t bits,
                                    Edges<N, Isa>& edges) {
    float x[3][N], y[3][N], u[N], v[N], w[N];
    for (int corner = 0; corner < 3; ++corner) {
        p[corner].x.store(x[corner]);
        p[corner].y.store(y[corner]);
    }
    edges.u.store(u), edges.v.store(v), edges.w.store(w);
    for (; bits != 0; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        u[i] = exact_sign_difference(x[2][i], y[1][i], y[2][i], x[1][i]);
        v[i] = exact_sign_difference(x[0][i], y[2][i], y[0][i], x[2][i]);
        w[i] = exact_sign_difference(x[1][i], y[0][i], y[1][i], x[0][i]);
    }
    edges = {Float<N, Isa>::load(u), Float<N, Isa>::load(v), Float<N, Isa>::load(w)};
}

/// Barycentric coordinates from edge functions in float are off by about 2^-24 |x| |y| / |det|,
/// where x and y are the largest of the sheared corners. Beyond this condition, as where a ray all
/// but lies in the triangle's plane, t would not be where the two meet, and a cell that holds a
/// part of the triangle might be skipped: then it is computed in double. (Up to it the error stays
/// within the slack of boxes.) Decided from floats that are the same on every ISA.
inline constexpr float kWorstCondition = 2.0f;

template <int N, class Isa>
PACKET_INLINE Mask<N, Isa> is_ill_conditioned(const Float3<N, Isa> (&p)[3],
                                              const Float<N, Isa>& det) {
    const Float<N, Isa> x = max(abs(p[0].x), max(abs(p[1].x), abs(p[2].x)));
    const Float<N, Isa> y = max(abs(p[0].y), max(abs(p[1].y), abs(p[2].y)));
    return abs(det) * Float<N, Isa>(kWorstCondition) < x * y;
}

/// t, u and v of the lanes in `bits`, in double from the sheared corners.
template <int N, class Isa>
[[gnu::noinline]] void refine_hits(const Float3<N, Isa> (&p)[3], const Float<N, Isa>& scale_z,
                                   std::uint32_t bits, TriangleHits<N, Isa>& hits) {
    float x[3][N], y[3][N], z[3][N], scale[N], t[N], u[N], v[N];
    for (int corner = 0; corner < 3; ++corner) {
        p[corner].x.store(x[corner]);
        p[corner].y.store(y[corner]);
        p[corner].z.store(z[corner]);
    }
    scale_z.store(scale), hits.t.store(t), hits.u.store(u), hits.v.store(v);
    for (; bits != 0; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        const auto edge = [&](int a, int b) {  // exact products, one rounding
            return static_cast<double>(x[a][i]) * y[b][i] - static_cast<double>(y[a][i]) * x[b][i];
        };
        const double edges[3] = {edge(2, 1), edge(0, 2), edge(1, 0)};
        const double det = edges[0] + edges[1] + edges[2];
        const double weights[3] = {edges[0] / det, edges[1] / det, edges[2] / det};
        const double depth = weights[0] * z[0][i] + weights[1] * z[1][i] + weights[2] * z[2][i];
        t[i] = static_cast<float>(depth * scale[i]);
        u[i] = static_cast<float>(weights[1]);
        v[i] = static_cast<float>(weights[2]);
    }
    hits.t = Float<N, Isa>::load(t);
    hits.u = Float<N, Isa>::load(u);
    hits.v = Float<N, Isa>::load(v);
}

/// One triangle of a block, in all lanes.
struct SameTriangle {
    const TriangleBlock& block;
    int lane;

    template <class F>
    PACKET_INLINE F get(int corner, int axis) const {
        return block.v[corner][axis][lane];
    }
    PACKET_INLINE SameTriangle part(int) const { return *this; }
};

/// A block's triangles, one a lane.
struct BlockTriangles {
    const TriangleBlock& block;
    int first = 0;

    template <class F>
    PACKET_INLINE F get(int corner, int axis) const {
        return F::load(block.v[corner][axis] + first);
    }
    PACKET_INLINE BlockTriangles part(int offset) const { return {block, first + offset}; }
};

/// A corner seen from the ray: sheared so that the ray runs along z from the origin.
template <Directions directions, int N, class Isa, class Triangles>
PACKET_INLINE Float3<N, Isa> to_ray_space(const ShearRays<N, Isa>& ray, const Triangles& triangles,
                                          int corner) {
    using F = Float<N, Isa>;
    const F d[3] = {triangles.template get<F>(corner, ray.axis[0]) - ray.org[0],
                    triangles.template get<F>(corner, ray.axis[1]) - ray.org[1],
                    triangles.template get<F>(corner, ray.axis[2]) - ray.org[2]};
    Float3<N, Isa> p = {d[0], d[1], d[2]};
    if constexpr (directions == Directions::kMixed) p = rotate_axes(ray, d);
    return {p.x - ray.shear_x * p.z, p.y - ray.shear_y * p.z, p.z};
}

/// Where the rays enter and leave the triangles' own boxes.
template <int N, class Isa>
PACKET_INLINE Interval<N, Isa> triangle_box(const PreparedRays<N, Isa>& ray,
                                            const Float<N, Isa> (&v)[3][3]) {
    Float<N, Isa> lower[3], upper[3];
    for (int a = 0; a < 3; ++a) {
        lower[a] = min(v[0][a], min(v[1][a], v[2][a]));
        upper[a] = max(v[0][a], max(v[1][a], v[2][a]));
    }
    return slabs(ray, lower, upper);
}

template <int N, class Isa>
PACKET_INLINE Edges<N, Isa> edge_functions(const Float3<N, Isa> (&p)[3]) {
    return {p[2].x * p[1].y - p[2].y * p[1].x, p[0].x * p[2].y - p[0].y * p[2].x,
            p[1].x * p[0].y - p[1].y * p[0].x};
}

template <Directions directions, int N, class Isa, class Triangles>
PACKET_INLINE Mask<N, Isa> may_hit_part(const ShearRays<N, Isa>& ray, const Triangles& triangles) {
    using F = Float<N, Isa>;
    const Float3<N, Isa> p[3] = {to_ray_space<directions>(ray, triangles, 0),
                                 to_ray_space<directions>(ray, triangles, 1),
                                 to_ray_space<directions>(ray, triangles, 2)};
    const Edges<N, Isa> e = edge_functions(p);
    // false where all are NaN, as in lanes without a triangle
    return (F(0.0f) <= min(e.u, min(e.v, e.w))) | (max(e.u, max(e.v, e.w)) <= F(0.0f));
}

/// The lanes whose ray passes inside the triangle or on its edges, as far as float can tell: no two
/// edges see it on different sides.
template <Directions directions, int N, class Isa, class Triangles>
PACKET_INLINE Mask<N, Isa> may_hit(const ShearRays<N, Isa>& ray, const Triangles& triangles) {
    if constexpr (LanesOf<N, Isa>::kRegisters == 1) {
        return may_hit_part<directions>(ray, triangles);
    } else {
        Mask<N, Isa> out;
        for (int i = 0; i < LanesOf<N, Isa>::kRegisters; ++i) {
            const auto its_triangles = triangles.part(i * kPartSize<N, Isa>);
            out.r[i] = may_hit_part<directions>(part(ray, i), its_triangles).r[0];
        }
        return out;
    }
}

/// The lanes whose edge functions do not contradict each other, once zeros are decided.
template <int N, class Isa>
PACKET_INLINE Mask<N, Isa> decide_zeros(const Float3<N, Isa> (&p)[3], Mask<N, Isa> candidates,
                                        Edges<N, Isa>& e) {
    const Float<N, Isa> zero(0.0f);
    const Mask<N, Isa> undecided = candidates & ((e.u == zero) | (e.v == zero) | (e.w == zero));
    if (none(undecided)) [[likely]]
        return candidates;
    const Float3<N, Isa> corners[3] = {p[0], p[1],
                                       p[2]};  // copies: what is passed on lies in memory
    Edges<N, Isa> decided = e;
    decide_edges(corners, undecided.bits(), decided);
    e = decided;
    return candidates & (((e.u >= zero) & (e.v >= zero) & (e.w >= zero)) |
                         ((e.u <= zero) & (e.v <= zero) & (e.w <= zero)));
}

template <Directions directions, int N, class Isa, class Triangles>
PACKET_INLINE TriangleHits<N, Isa> decide_hits_of_part(const PreparedRays<N, Isa>& ray,
                                                       const Float<N, Isa>& best_t,
                                                       Mask<N, Isa> candidates,
                                                       const Triangles& triangles) {
    using F = Float<N, Isa>;
    const F zero(0.0f), scale_z = ray.shear.scale_z;
    const Float3<N, Isa> p[3] = {to_ray_space<directions>(ray.shear, triangles, 0),
                                 to_ray_space<directions>(ray.shear, triangles, 1),
                                 to_ray_space<directions>(ray.shear, triangles, 2)};
    Edges<N, Isa> e = edge_functions(p);
    TriangleHits<N, Isa> out;
    out.hit = decide_zeros(p, candidates, e);
    const F det = e.u + e.v + e.w;
    out.hit = out.hit & ~(det == zero);

    // u and v are the barycentric coordinates that belong to the second and third corner
    const F first = e.u / det;
    out.u = e.v / det, out.v = e.w / det;
    out.t = first * (scale_z * p[0].z) + out.u * (scale_z * p[1].z) + out.v * (scale_z * p[2].z);
    const Mask<N, Isa> ill = out.hit & is_ill_conditioned(p, det);
    if (any(ill)) [[unlikely]] {
        const Float3<N, Isa> ill_corners[3] = {p[0], p[1], p[2]};  // copies, as above
        TriangleHits<N, Isa> refined = out;
        refine_hits(ill_corners, scale_z, ill.bits(), refined);
        out = refined;
    }

    F lower[3], upper[3];
    for (int a = 0; a < 3; ++a) {
        const F x0 = triangles.template get<F>(0, a), x1 = triangles.template get<F>(1, a),
                x2 = triangles.template get<F>(2, a);
        lower[a] = min(x0, min(x1, x2));
        upper[a] = max(x0, max(x1, x2));
    }
    const Interval<N, Isa> box = slabs(ray, lower, upper);
    // max and min yield their second operand for NaN: a NaN stays one and fails the comparisons
    const F t = min(box.exit, max(box.enter, out.t)) + zero;  // + 0 makes -0 a 0
    out.hit = out.hit & (box.enter <= box.exit) & (ray.tnear <= t) & (t <= best_t);
    out.t = t;
    out.u = out.u + zero;
    out.v = out.v + zero;
    return out;
}

/// Which of `candidates`, lanes that may hit, do: the ray passes inside or on the edges, the
/// triangle's box is met, and t, moved into that box, lies in [tnear, best_t].
template <Directions directions, int N, class Isa, class Triangles>
PACKET_INLINE TriangleHits<N, Isa> decide_hits(const PreparedRays<N, Isa>& ray,
                                               const Float<N, Isa>& best_t, Mask<N, Isa> candidates,
                                               const Triangles& triangles) {
    if constexpr (LanesOf<N, Isa>::kRegisters == 1) {
        return decide_hits_of_part<directions>(ray, best_t, candidates, triangles);
    } else {
        TriangleHits<N, Isa> out;
        for (int i = 0; i < LanesOf<N, Isa>::kRegisters; ++i) {
            const auto hits =
                decide_hits_of_part<directions>(part(ray, i), part(best_t, i), part(candidates, i),
                                                triangles.part(i * kPartSize<N, Isa>));
            out.hit.r[i] = hits.hit.r[0];
            out.t.r[i] = hits.t.r[0], out.u.r[i] = hits.u.r[0], out.v.r[i] = hits.v.r[0];
        }
        return out;
    }
}

}  // namespace packet
