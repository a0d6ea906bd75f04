// A beam holds all rays of a tile: four lines in the planes of their longest axis bound where they
// can be, whether or not they share an origin. It is tested instead of the rays, against eight
// boxes or eight triangles at once, and never misses what one of the rays hits.
//
// Wald, Boulos, Shirley. Ray tracing deformable scenes using dynamic bounding volume hierarchies.
// TOG 2007. Overbeck, Ramamoorthi, Mark. Large ray packets for real-time Whitted ray tracing. RT
// 2008.
#pragma once

#include "kernels/best_hit.h"
#include "kernels/transpose.h"

namespace packet {

/// Whether the beam follows the lower or the upper bound of the rays, as sides of boxes are
/// counted.
enum BeamSide { kLower, kUpper, kBeamSides };

/// What bounds the active lanes of some packets, before it is cast into the beam's shape.
struct BeamBounds {
    int axis[3];                  ///< the axes that become x, y, z, z being the longest
    int near_side;                ///< the plane of z that rays meet first
    float slope[2][kBeamSides];   ///< of x and y over z: the lines that bound them lower and upper
    float offset[2][kBeamSides];  ///< x and y where these lines cross z = anchor
    float anchor;                 ///< no ray begins before it, or none goes on behind it
    float away;                   ///< the sign of z - anchor where rays are
    float begin, end;             ///< of the rays, along z times its direction
    float margin;                 ///< what rounding may come to, amply
    float origin[3];              ///< x, y and z where the rays start
    bool has_origin;              ///< if all of them start there
    bool is_sound;                ///< no ray looks back, and all numbers are finite

    /// How wide the beam gets on a way along z.
    [[nodiscard]] PACKET_INLINE float width(float way) const {
        float widest = 0.0f;
        for (int a = 0; a < 2; ++a) {
            const float spread = __builtin_fabsf(slope[a][kUpper] - slope[a][kLower]);
            const float width = offset[a][kUpper] - offset[a][kLower] + way * spread;
            widest = widest < width ? width : widest;
        }
        return widest;
    }
};

/// The lanes of a packet that count: those that are active, or all.
template <int N, class Isa>
struct ActiveLanes {
    Mask<N, Isa> active;

    PACKET_INLINE Float<N, Isa> choose(const Float<N, Isa>& value,
                                       const Float<N, Isa>& other) const {
        return select(active, value, other);
    }
    PACKET_INLINE Mask<N, Isa> fail(Mask<N, Isa> condition) const { return active & ~condition; }
};
template <int N, class Isa>
struct AllLanes {
    PACKET_INLINE Float<N, Isa> choose(const Float<N, Isa>& value, const Float<N, Isa>&) const {
        return value;
    }
    PACKET_INLINE Mask<N, Isa> fail(Mask<N, Isa> condition) const { return ~condition; }
};

/// The lower and upper bound of the lanes that count.
template <int N, class Isa>
struct LaneBounds {
    using F = Float<N, Isa>;
    F lower = __builtin_huge_valf(), upper = -__builtin_huge_valf();

    template <class Lanes>
    PACKET_INLINE void extend(const Lanes& lanes, const F& value) {
        lower = min(lower, lanes.choose(value, __builtin_huge_valf()));
        upper = max(upper, lanes.choose(value, -__builtin_huge_valf()));
    }
};

/// The smallest lane of each of eight values.
template <int N, class Isa>
PACKET_INLINE void smallest_lanes(const Float<N, Isa> (&in)[8], float (&out)[8]) {
    static_assert(N % 8 == 0);
    using Eight = Float<8, Isa>;
    float rows[8][8];
    const float* from[8];
    for (int i = 0; i < 8; ++i) {
        float lanes[N];
        in[i].store(lanes);
        Eight least = Eight::load(lanes);
        for (int k = 8; k < N; k += 8) least = min(least, Eight::load(lanes + k));
        least.store(rows[i]);
        from[i] = rows[i];
    }
    Floats8 columns[8];
    transpose(from, columns);
    Eight column[8];
    for (int i = 0; i < 8; ++i) {
        *as_row(rows[i]) = columns[i];
        column[i] = Eight::load(rows[i]);
    }
    for (int step = 4; step > 0; step /= 2) {
        for (int i = 0; i < step; ++i) column[i] = min(column[i], column[i + step]);
    }
    column[0].store(out);
}

/// Bounds the active lanes (best.t > kNever) of packets that share their directions.
template <int N, class Isa>
class BeamBuilder {
public:
    using F = Float<N, Isa>;
    using M = Mask<N, Isa>;

    PACKET_INLINE BeamBuilder(const PreparedRays<N, Isa>* rays, const BestHits<N, Isa>* best,
                              int packet_count)
        : rays_(rays), best_(best), packet_count_(packet_count) {}

    PACKET_INLINE BeamBounds build() {
        F least = best_[0].t;
        for (int p = 1; p < packet_count_; ++p) least = min(least, best_[p].t);
        if (none(~(least > F(kNever)))) [[likely]]
            return bound([](int) { return AllLanes<N, Isa>(); });
        return bound([&](int p) { return ActiveLanes<N, Isa>{is_active(p)}; });
    }

private:
    static constexpr float kFarthest = 1e30f;

    PACKET_INLINE M is_active(int packet) const { return best_[packet].t > F(kNever); }

    /// The lanes lanes_of(p) of packet p count.
    template <class LanesOf>
    PACKET_INLINE BeamBounds bound(LanesOf&& lanes_of) const {
        BeamBounds out;
        for (int a = 0; a < 3; ++a) out.axis[a] = rays_[0].shear.axis[a];
        out.near_side = rays_[0].near_side[out.axis[2]];
        const float sign = out.near_side == 0 ? 1.0f : -1.0f;
        LaneBounds<N, Isa> slope[2], begin, end;
        F first(__builtin_huge_valf()), margin(0.0f);
        M looks_back = M::from_bits(0), starts_elsewhere = looks_back;
        find_start(out.origin);
        for (int p = 0; p < packet_count_; ++p) {
            const PreparedRays<N, Isa>& ray = rays_[p];
            const auto lanes = lanes_of(p);
            slope[0].extend(lanes, ray.shear.shear_x);
            slope[1].extend(lanes, ray.shear.shear_y);
            const F z = ray.shear.org[2] * F(sign);
            first = min(first, lanes.choose(z, first));
            looks_back = looks_back | lanes.fail(ray.hit.tnear >= F(0.0f));
            begin.extend(lanes, z + ray.hit.tnear * ray.speed);
            end.extend(lanes, z + best_[p].t * ray.speed);
            for (int a = 0; a < 3; ++a) {
                margin = max(margin, lanes.choose(ray.hit.org[0][a] - ray.hit.org[1][a], margin));
                starts_elsewhere =
                    starts_elsewhere | lanes.fail(ray.shear.org[a] == F(out.origin[a]));
            }
        }
        const F zero(0.0f);
        const F values[8] = {
            first,          begin.lower,    zero - end.upper,      zero - margin,
            slope[0].lower, slope[1].lower, zero - slope[0].upper, zero - slope[1].upper};
        float least[8];
        smallest_lanes(values, least);
        out.begin = least[1], out.end = -least[2];
        // The difference of the grown origins is twice the growth, which bounds a hit's rounding.
        out.margin = -4.0f * least[3];
        const float lowest[2] = {least[4], least[5]}, highest[2] = {-least[6], -least[7]};
        out.has_origin = none(starts_elsewhere);
        anchor(out, lowest, highest, least[0] * sign, sign, lanes_of);
        out.is_sound = none(looks_back) && extent(out) < kFarthest;  // false for NaN
        return out;
    }

    /// Where the first active ray starts, or one of the first packet's if that has none.
    PACKET_INLINE void find_start(float (&out)[3]) const {
        const int lane = __builtin_ctz(is_active(0).bits() | 1u << (N - 1));
        for (int a = 0; a < 3; ++a) {
            float org[N];
            rays_[0].shear.org[a].store(org);
            out[a] = org[lane];
        }
    }

    struct Crossing {
        float lower[2], upper[2];
        PACKET_INLINE float spread() const { return upper[0] - lower[0] + (upper[1] - lower[1]); }
    };
    /// Where the rays cross two planes of z.
    template <class LanesOf>
    PACKET_INLINE void cross(const float (&plane)[2], Crossing (&out)[2],
                             LanesOf&& lanes_of) const {
        LaneBounds<N, Isa> bounds[2][2];
        for (int p = 0; p < packet_count_; ++p) {
            const ShearRays<N, Isa>& shear = rays_[p].shear;
            const auto lanes = lanes_of(p);
            for (int i = 0; i < 2; ++i) {
                const F way = F(plane[i]) - shear.org[2];
                bounds[i][0].extend(lanes, shear.org[0] + shear.shear_x * way);
                bounds[i][1].extend(lanes, shear.org[1] + shear.shear_y * way);
            }
        }
        F values[8];
        for (int i = 0; i < 4; ++i) {
            values[2 * i] = bounds[i / 2][i % 2].lower;
            values[2 * i + 1] = F(0.0f) - bounds[i / 2][i % 2].upper;
        }
        float least[8];
        smallest_lanes(values, least);
        for (int i = 0; i < 4; ++i) {
            out[i / 2].lower[i % 2] = least[2 * i];
            out[i / 2].upper[i % 2] = -least[2 * i + 1];
        }
    }

    /// Rays from an eye spread from their begin, rays to a light narrow to their end: the lines
    /// start where the rays are closest, unless that is so far away that rounding there exceeds the
    /// margin. After the anchor it is the ray of least slope that is lowest, before it that of
    /// greatest.
    template <class LanesOf>
    PACKET_INLINE void anchor(BeamBounds& out, const float (&lowest)[2], const float (&highest)[2],
                              float begin, float sign, LanesOf&& lanes_of) const {
        // The margin is 64 ulp of the scene's reach at least, and a line's rounding 8 ulp of its
        // way to the anchor and 6 of the reach: the way may be 4 times as long as the reach.
        constexpr float kUlps = 16.0f / 16777216.0f;
        const bool has_end = (out.end - begin * sign) * kUlps <= out.margin;  // false for inf, NaN
        const float plane[2] = {begin, has_end ? out.end * sign : begin};
        Crossing at[2];
        bool is_after = true;
        if (out.has_origin) {
            for (int a = 0; a < 2; ++a) at[0].lower[a] = at[0].upper[a] = out.origin[a];
        } else {
            cross(plane, at, lanes_of);
            is_after = !(has_end && at[1].spread() < at[0].spread());
        }
        const Crossing& crossing = at[is_after ? 0 : 1];
        out.anchor = plane[is_after ? 0 : 1];
        out.away = is_after ? sign : -sign;
        const int lower = is_after == (sign > 0.0f) ? kLower : kUpper;
        for (int a = 0; a < 2; ++a) {
            out.slope[a][lower] = lowest[a];
            out.slope[a][1 - lower] = highest[a];
            out.offset[a][kLower] = crossing.lower[a];
            out.offset[a][kUpper] = crossing.upper[a];
        }
    }

    PACKET_INLINE static float extent(const BeamBounds& bounds) {
        float out = __builtin_fabsf(bounds.anchor) + bounds.margin;
        for (const auto& offset : bounds.offset) {
            out += __builtin_fabsf(offset[kLower]) + __builtin_fabsf(offset[kUpper]);
        }
        return out;
    }

    const PreparedRays<N, Isa>* rays_;
    const BestHits<N, Isa>* best_;
    int packet_count_;
};

template <int N, class Isa>
[[gnu::noinline]] BeamBounds bound_rays(const PreparedRays<N, Isa>* rays,
                                        const BestHits<N, Isa>* best, int packet_count) {
    return BeamBuilder<N, Isa>(rays, best, packet_count).build();
}

/// The beam in 8 lanes, for 8 boxes or triangles.
template <class Isa>
class Beam {
public:
    using F = Float<kWideSize, Isa>;
    using M = Mask<kWideSize, Isa>;

    Beam() = default;
    PACKET_INLINE explicit Beam(const BeamBounds& bounds) {
        for (int a = 0; a < 3; ++a) axis_[a] = bounds.axis[a];
        near_side_ = bounds.near_side;
        for (int a = 0; a < 2; ++a) {
            for (int side = 0; side < kBeamSides; ++side) {
                const float slope = bounds.slope[a][side];
                const float outward = side == kLower ? -bounds.margin : bounds.margin;
                slope_[a][side] = slope;
                // x of the line is slope * z - start
                start_[a][side] = slope * bounds.anchor - (bounds.offset[a][side] + outward);
                // Of a box the plane of z where the line is most to the outside.
                z_side_[a][side] = (slope >= 0.0f) == (side == kLower) ? 0 : 1;
            }
        }
        constexpr float kRounding = 0x1p-20f;
        sign_ = near_side_ == 0 ? 1.0f : -1.0f;
        begin_ = bounds.begin - __builtin_fabsf(bounds.begin) * kRounding - bounds.margin;
        end_ = bounds.end + __builtin_fabsf(bounds.end) * kRounding + bounds.margin;
    }

    [[nodiscard]] PACKET_INLINE std::uint32_t meets(const WideNode& node) const {
        F depth;
        return meets(node, depth);
    }
    /// The children whose boxes the beam may meet, and in `depth` where along its way.
    PACKET_INLINE std::uint32_t meets(const WideNode& node, F& depth) const {
        depth = F::load(node.plane[near_side_][axis_[2]]) * sign_;
        const F far = F::load(node.plane[1 - near_side_][axis_[2]]) * sign_;
        M hit = (depth <= end_) & (begin_ <= far);
        for (int a = 0; a < 2; ++a) {
            const auto line = [&](BeamSide side) {
                const float* z = node.plane[z_side_[a][side]][axis_[2]];
                return multiply_subtract(F::load(z), slope_[a][side], start_[a][side]);
            };
            hit = hit & (line(kLower) <= F::load(node.plane[1][axis_[a]])) &
                  (F::load(node.plane[0][axis_[a]]) <= line(kUpper));
        }
        return hit.bits();
    }

    /// The triangles that are not all on the outside of one line.
    PACKET_INLINE std::uint32_t meets(const TriangleBlock& block) const {
        M outside = M::from_bits(0);
        for (int a = 0; a < 2; ++a) {
            F below, above;
            for (int corner = 0; corner < 3; ++corner) {
                const F x = F::load(block.v[corner][axis_[a]]);
                const F z = F::load(block.v[corner][axis_[2]]);
                const F lower = multiply_subtract(z, slope_[a][kLower], start_[a][kLower]) - x;
                const F upper = multiply_subtract(z, slope_[a][kUpper], start_[a][kUpper]) - x;
                below = corner == 0 ? lower : min(below, lower);
                above = corner == 0 ? upper : max(above, upper);
            }
            outside = outside | (F(0.0f) < below) | (above < F(0.0f));
        }
        return (~outside).bits();
    }

private:
    F slope_[2][kBeamSides], start_[2][kBeamSides];
    F sign_, begin_, end_;
    int axis_[3], near_side_, z_side_[2][kBeamSides];
};

}  // namespace packet
