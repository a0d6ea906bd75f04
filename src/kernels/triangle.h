// The watertight triangle test, in the lanes of whoever calls: many rays and one triangle, or one
// ray and many triangles. Three edge functions of the sheared triangle tell on which side of each
// edge the ray passes. Their signs are exact, so two triangles that share an edge never disagree
// about it and no ray slips through between them.
//
// It comes in two steps. shear() computes the edge functions in float, where rounding may turn a
// sign to zero but never over: may_hit() rejects nothing that hits, and nearly all that does not.
// decide_hits() settles the few lanes that are left.
//
// Woop, Benthin, Wald. Watertight ray/triangle intersection. JCGT 2013.
#pragma once

#include "core/bits.h"
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

/// Lanes in memory, for the rare steps that go lane by lane. Filled where those steps begin: values
/// whose address is taken earlier would lie in memory on the way there too.
template <int N>
struct StoredCorners {
    float x[3][N], y[3][N], z[3][N];

    template <class Isa>
    PACKET_INLINE explicit StoredCorners(const Float3<N, Isa> (&p)[3]) {
        for (int i = 0; i < 3; ++i) p[i].x.store(x[i]), p[i].y.store(y[i]), p[i].z.store(z[i]);
    }
};
template <int N>
struct StoredEdges {
    float u[N], v[N], w[N];
};
template <int N>
struct StoredHits {
    float scale_z[N], t[N], u[N], v[N];
};

/// Recomputes the edge functions of the lanes in `bits` so that zero means zero. Rare: rays that
/// pass an edge or a corner as closely as float can tell.
template <int N, class Isa>
PACKET_NOINLINE void decide_edges(const StoredCorners<N>& p, std::uint32_t bits,
                                  StoredEdges<N>& e) {
    for (; bits != 0; bits &= bits - 1) {
        const int i = lowest_bit(bits);
        e.u[i] = exact_sign_difference(p.x[2][i], p.y[1][i], p.y[2][i], p.x[1][i]);
        e.v[i] = exact_sign_difference(p.x[0][i], p.y[2][i], p.y[0][i], p.x[2][i]);
        e.w[i] = exact_sign_difference(p.x[1][i], p.y[0][i], p.y[1][i], p.x[0][i]);
    }
}

/// Barycentric coordinates from edge functions in float are off by about 2^-24 |x| |y| / |det|,
/// where x and y are the largest of the sheared corners. Beyond this condition, as where a ray all
/// but lies in the triangle's plane, t would not be where the two meet, and a cell that holds a
/// part of the triangle might be skipped: then it is computed in double. (Up to it the error stays
/// within the slack of boxes.) Decided from floats that are the same on every ISA.
inline constexpr float kWorstCondition = 2.0f;

/// |x| |y|.
template <int N, class Isa>
PACKET_INLINE Float<N, Isa> largest_area(const Float3<N, Isa> (&p)[3]) {
    const Float<N, Isa> x = max(abs(p[0].x), max(abs(p[1].x), abs(p[2].x)));
    const Float<N, Isa> y = max(abs(p[0].y), max(abs(p[1].y), abs(p[2].y)));
    return x * y;
}
template <int N, class Isa>
PACKET_INLINE Mask<N, Isa> is_ill_conditioned(const Float3<N, Isa> (&p)[3],
                                              const Float<N, Isa>& det) {
    return abs(det) * Float<N, Isa>(kWorstCondition) < largest_area(p);
}

/// t, u and v of a lane, in double from the sheared corners.
template <int N>
PACKET_INLINE void refine_hit(const StoredCorners<N>& p, int i, StoredHits<N>& hits) {
    const auto edge = [&](int a, int b) {  // exact products, one rounding
        return static_cast<double>(p.x[a][i]) * p.y[b][i] -
               static_cast<double>(p.y[a][i]) * p.x[b][i];
    };
    const double edges[3] = {edge(2, 1), edge(0, 2), edge(1, 0)};
    const double det = edges[0] + edges[1] + edges[2];
    const double weights[3] = {edges[0] / det, edges[1] / det, edges[2] / det};
    const double depth = weights[0] * p.z[0][i] + weights[1] * p.z[1][i] + weights[2] * p.z[2][i];
    hits.t[i] = static_cast<float>(depth * hits.scale_z[i]);
    hits.u[i] = static_cast<float>(weights[1]);
    hits.v[i] = static_cast<float>(weights[2]);
}
/// Of the lanes in `bits`, and maybe of others: a loop over all lanes becomes one of registers,
/// which costs as much as some three lanes one by one.
template <int N, class Isa>
PACKET_NOINLINE void refine_hits(const StoredCorners<N>& corners, std::uint32_t bits,
                                 StoredHits<N>& hits) {
    constexpr int kMostOneByOne = 3;
    if (set_bits(bits) <= kMostOneByOne) {
        for (; bits != 0; bits &= bits - 1) refine_hit(corners, lowest_bit(bits), hits);
    } else {
        StoredHits<N> out = hits;  // nothing that is written is read
        for (int i = 0; i < N; ++i) refine_hit(corners, i, out);
        hits = out;
    }
}

/// One triangle of a block, in all lanes.
struct SameTriangle {
    const TriangleBlock& block;
    int lane;

    template <class F>
    PACKET_INLINE F get(int corner, int axis) const {
        return block.v[corner][axis][lane];
    }
    [[nodiscard]] PACKET_INLINE std::int32_t prim_id() const { return block.prim_id[lane]; }
};

/// A block's triangles, one a lane.
struct BlockTriangles {
    const TriangleBlock& block;

    template <class F>
    PACKET_INLINE F get(int corner, int axis) const {
        return F::load(block.v[corner][axis]);
    }
};

/// Triangles of a block, in each lane the one that it has picked.
template <int N, class Isa>
struct PickedTriangles {
    const TriangleBlock& block;
    Int<N, Isa> which;
    static_assert(kBlockSize == 8);

    template <class F>
    PACKET_INLINE F get(int corner, int axis) const {
        return pick(block.v[corner][axis], which);
    }
    [[nodiscard]] PACKET_INLINE Int<N, Isa> prim_id() const { return pick(block.prim_id, which); }
};

/// A block as packets meet it.
struct BlockCorners {
    const TriangleBlock& block;

    [[nodiscard]] PACKET_INLINE SameTriangle one(int lane) const { return {block, lane}; }
    [[nodiscard]] PACKET_INLINE BlockTriangles all() const { return {block}; }
};

/// The corners of a block's triangles less the origin that all rays of a tile share, axes in the
/// order of their shear: found once for eight triangles, not for each of them and each packet. The
/// bits are those that each lane would find, but for the sign of zeros, which decides nothing.
struct RelativeCorners {
    alignas(32) float v[3][3][kBlockSize];

    template <class Isa>
    PACKET_INLINE RelativeCorners(const TriangleBlock& block, const float (&org)[3],
                                  const int (&axis)[3], Isa) {
        using F = Float<kBlockSize, Isa>;
        for (int corner = 0; corner < 3; ++corner) {
            for (int a = 0; a < 3; ++a)
                (F::load(block.v[corner][axis[a]]) - F(org[a])).store(v[corner][a]);
        }
    }

    struct One {
        const RelativeCorners& corners;
        int lane;

        template <class F>
        PACKET_INLINE F get(int corner, int axis) const {
            return corners.v[corner][axis][lane];
        }
    };
    struct All {
        const RelativeCorners& corners;

        template <class F>
        PACKET_INLINE F get(int corner, int axis) const {
            return F::load(corners.v[corner][axis]);
        }
    };
    [[nodiscard]] PACKET_INLINE One one(int lane) const { return {*this, lane}; }
    [[nodiscard]] PACKET_INLINE All all() const { return {*this}; }
};
template <class Triangles>
inline constexpr bool kIsRelative = false;
template <>
inline constexpr bool kIsRelative<RelativeCorners::One> = true;
template <>
inline constexpr bool kIsRelative<RelativeCorners::All> = true;

/// A corner seen from the ray: sheared so that the ray runs along z from the origin.
template <Directions directions, int N, class Isa, class Triangles>
PACKET_INLINE Float3<N, Isa> to_ray_space(const ShearRays<N, Isa>& ray, const Triangles& triangles,
                                          int corner) {
    using F = Float<N, Isa>;
    F d[3];
    for (int a = 0; a < 3; ++a) {
        if constexpr (kIsRelative<Triangles>) {
            d[a] = triangles.template get<F>(corner, a);
        } else {
            d[a] = triangles.template get<F>(corner, ray.axis[a]) - ray.org[a];
        }
    }
    Float3<N, Isa> p = {d[0], d[1], d[2]};
    if constexpr (directions == Directions::kMixed) p = rotate_axes(ray, d);
    return {p.x - ray.shear_x * p.z, p.y - ray.shear_y * p.z, p.z};
}

/// Where the rays enter and leave the triangles' own boxes.
template <int N, class Isa, class Rays, class Triangles>
PACKET_INLINE Interval<N, Isa> triangle_box(const Rays& ray, const Triangles& triangles) {
    using F = Float<N, Isa>;
    F lower[3], upper[3];
    for (int a = 0; a < 3; ++a) {
        const F x0 = triangles.template get<F>(0, a), x1 = triangles.template get<F>(1, a),
                x2 = triangles.template get<F>(2, a);
        lower[a] = min(x0, min(x1, x2));
        upper[a] = max(x0, max(x1, x2));
    }
    return slabs(ray, lower, upper);
}

template <int N, class Isa>
PACKET_INLINE Edges<N, Isa> edge_functions(const Float3<N, Isa> (&p)[3]) {
    return {p[2].x * p[1].y - p[2].y * p[1].x, p[0].x * p[2].y - p[0].y * p[2].x,
            p[1].x * p[0].y - p[1].y * p[0].x};
}

/// Triangles in the space of rays.
template <int N, class Isa>
struct ShearedTriangles {
    Float3<N, Isa> corner[3];
    Edges<N, Isa> edges;

    /// The lanes whose ray passes inside the triangle or on its edges, as far as float can tell: no
    /// two edges see it on different sides.
    PACKET_INLINE Mask<N, Isa> may_hit() const {
        using F = Float<N, Isa>;
        const F lowest = min(edges.u, min(edges.v, edges.w));
        const F highest = max(edges.u, max(edges.v, edges.w));
        return (F(0.0f) <= lowest) | (highest <= F(0.0f));  // false for NaN: no triangle
    }
};

template <Directions directions, int N, class Isa, class Triangles>
PACKET_INLINE ShearedTriangles<N, Isa> shear(const ShearRays<N, Isa>& ray,
                                             const Triangles& triangles) {
    ShearedTriangles<N, Isa> out;
    for (int i = 0; i < 3; ++i) out.corner[i] = to_ray_space<directions>(ray, triangles, i);
    out.edges = edge_functions(out.corner);
    return out;
}

/// The lanes whose edge functions do not contradict each other, once zeros are decided.
template <int N, class Isa>
PACKET_INLINE Mask<N, Isa> decide_zeros(const Float3<N, Isa> (&p)[3], Mask<N, Isa> candidates,
                                        Edges<N, Isa>& e) {
    using F = Float<N, Isa>;
    const F zero(0.0f);
    const Mask<N, Isa> undecided = candidates & ((e.u == zero) | (e.v == zero) | (e.w == zero));
    if (none(undecided)) [[likely]]
        return candidates;
    StoredEdges<N> edges;
    e.u.store(edges.u), e.v.store(edges.v), e.w.store(edges.w);
    decide_edges<N, Isa>(StoredCorners<N>(p), undecided.bits(), edges);
    e = {F::load(edges.u), F::load(edges.v), F::load(edges.w)};
    return candidates & (((e.u >= zero) & (e.v >= zero) & (e.w >= zero)) |
                         ((e.u <= zero) & (e.v <= zero) & (e.w <= zero)));
}

/// Lanes of which decide_hits() need not be asked.
template <int N, class Isa>
struct Verdicts {
    Mask<N, Isa> hit, miss;
};

/// Of lanes that may hit, those that surely do and those that surely do not, which most of them
/// are: rays that start on a surface may hit the triangle that they start on, and others behind
/// them or beyond best_t. docs/decisions/depth-margin.md shows that the margin holds.
template <int N, class Isa, class Rays>
PACKET_INLINE Verdicts<N, Isa> judge(const ShearedTriangles<N, Isa>& sheared, const Rays& ray,
                                     const Float<N, Isa>& best_t) {
    using F = Float<N, Isa>;
    constexpr float kMargin = 0x1.8p-20f;
    constexpr float kLeastDepth = 0x1p-20f, kLeastArea = 0x1p-80f;
    constexpr float kGuard = 0x1p24f;  // where a product below overflows, the margin is no number
    const Float3<N, Isa>(&p)[3] = sheared.corner;
    const Edges<N, Isa>& e = sheared.edges;
    const F per_area = F(1.0f) / (e.u + e.v + e.w);
    const F t[3] = {ray.scale_z * p[0].z, ray.scale_z * p[1].z, ray.scale_z * p[2].z};
    const F depth = (e.u * t[0] + e.v * t[1] + e.w * t[2]) * per_area;
    const F farthest = max(abs(t[0]), max(abs(t[1]), abs(t[2])));
    const F least_margin = farthest * F(kMargin) + F(kMargin * kLeastDepth);
    const F area = largest_area(p) * F(kGuard) + F(kGuard * kLeastArea);
    const F margin = area * least_margin * (abs(per_area) * F(1.0f / kGuard)) + least_margin;
    const F earliest = depth - margin, latest = depth + margin;
    // false for NaN, as all comparisons are
    const Mask<N, Isa> inside =
        (F(0.0f) < min(e.u, min(e.v, e.w))) | (max(e.u, max(e.v, e.w)) < F(0.0f));
    return {inside & (ray.tnear <= earliest) & (latest <= best_t),
            (latest < ray.tnear) | (best_t < earliest)};
}

/// Which of `candidates`, lanes that may hit, do: the ray passes inside or on the edges, the
/// triangle's box is met, and t, moved into that box, lies in [tnear, best_t].
template <int N, class Isa, class Rays, class Triangles>
PACKET_INLINE TriangleHits<N, Isa> decide_hits(const ShearedTriangles<N, Isa>& sheared,
                                               const Rays& ray, const Float<N, Isa>& best_t,
                                               Mask<N, Isa> candidates,
                                               const Triangles& triangles) {
    using F = Float<N, Isa>;
    const F zero(0.0f);
    const Float3<N, Isa>(&p)[3] = sheared.corner;
    Edges<N, Isa> e = sheared.edges;
    TriangleHits<N, Isa> out;
    out.hit = decide_zeros(p, candidates, e);
    const F det = e.u + e.v + e.w;
    out.hit = out.hit & ~(det == zero);

    // u and v are the barycentric coordinates that belong to the second and third corner
    const F first = e.u / det;
    out.u = e.v / det, out.v = e.w / det;
    out.t = first * (ray.scale_z * p[0].z) + out.u * (ray.scale_z * p[1].z) +
            out.v * (ray.scale_z * p[2].z);
    const Mask<N, Isa> ill = out.hit & is_ill_conditioned(p, det);
    if (any(ill)) [[unlikely]] {
        StoredHits<N> hits;
        F(ray.scale_z).store(hits.scale_z);
        out.t.store(hits.t), out.u.store(hits.u), out.v.store(hits.v);
        refine_hits<N, Isa>(StoredCorners<N>(p), ill.bits(), hits);
        out.t = select(ill, F::load(hits.t), out.t);
        out.u = select(ill, F::load(hits.u), out.u);
        out.v = select(ill, F::load(hits.v), out.v);
    }

    const Interval<N, Isa> box = triangle_box<N, Isa>(ray, triangles);
    // max and min yield their second operand for NaN: a NaN stays one and fails the comparisons
    const F t = min(box.exit, max(box.enter, out.t)) + zero;  // + 0 makes -0 a 0
    out.hit = out.hit & (box.enter <= box.exit) & (ray.tnear <= t) & (t <= best_t);
    out.t = t;
    out.u = out.u + zero;
    out.v = out.v + zero;
    return out;
}

/// Which of `candidates` hit, all computed anew: rare, so that registers need not be kept for it.
template <Directions directions, int N, class Isa, class Triangles>
PACKET_NOINLINE std::uint32_t decide_part(const PreparedRays<N, Isa>& ray,
                                          const Float<N, Isa>& best_t, std::uint32_t candidates,
                                          const Triangles& triangles, int i) {
    const auto sheared = shear<directions>(part(ray.shear, ray.shear.axis, i), triangles);
    const auto lanes = Mask<kPartSize<N, Isa>, Isa>::from_bits(candidates);
    return decide_hits(sheared, part(ray.hit, i), part(best_t, i), lanes, triangles).hit.bits();
}

/// For any-hit: which of `candidates`, lanes of register i that may hit, do.
template <Directions directions, int N, class Isa, int kPart, class Triangles>
PACKET_INLINE Mask<kPart, Isa> decide_occluded(const ShearedTriangles<kPart, Isa>& sheared,
                                               const PreparedRays<N, Isa>& ray,
                                               const Float<N, Isa>& best_t,
                                               Mask<kPart, Isa> candidates,
                                               const Triangles& triangles, int i) {
    const auto verdicts = judge(sheared, part(ray.hit, i), part(best_t, i));
    const auto hit = candidates & verdicts.hit;
    const auto undecided = candidates & ~(verdicts.hit | verdicts.miss);
    if (none(undecided)) [[likely]]
        return hit;
    return hit | Mask<kPart, Isa>::from_bits(
                     decide_part<directions>(ray, best_t, undecided.bits(), triangles, i));
}

}  // namespace packet
