// Which packets of a tile may meet which children of a node, or triangles of a block. Where a
// beam's rays spread from, or narrow to, is its anchor, and seen from there each packet is a range
// of slopes and each box or triangle another: these are found once, for eight of them at a time,
// and then four comparisons tell which of the eight a packet may meet, or which of eight packets
// meet one.
#pragma once

#include "kernels/beam.h"

namespace packet {

/// Slopes, over the way from the anchor, that lines of a beam may have to boxes or triangles, one a
/// lane.
template <class Isa>
struct SlopeRanges {
    Float<kWideSize, Isa> least[2], most[2];
    Mask<kWideSize, Isa> open;  ///< what reaches behind the anchor: it may have any
};
static_assert(kBlockSize == kWideSize);

/// The slopes of a beam's packets, at most kPackets of them. Rounding here is 4 ulp of a triangle's
/// distance from the anchor, 5 reaches at most, and with that of the beam's lines 47 ulp of the
/// reach: the margin is 64.
template <int kPackets, class Isa>
class PacketSlopes {
public:
    template <int N>
    PACKET_INLINE PacketSlopes(const BeamBounds& bounds, const PreparedRays<N, Isa>* rays,
                               const BestHits<N, Isa>* best, int packet_count)
        : away_(bounds.away), anchor_(bounds.anchor * bounds.away) {
        for (int a = 0; a < 3; ++a) axis_[a] = bounds.axis[a];
        for (int a = 0; a < 2; ++a) {
            offset_[a][kLower] = bounds.offset[a][kLower] - bounds.margin;
            offset_[a][kUpper] = bounds.offset[a][kUpper] + bounds.margin;
            for (int first = 0; first < kPackets; first += 8) {
                find_slopes(a, first, bounds.away, rays, best, packet_count);
            }
            const float one = bounds.slope[a][kLower] * bounds.away;
            const float other = bounds.slope[a][kUpper] * bounds.away;
            least_of_all_[a] = one < other ? one : other;
            most_of_all_[a] = one < other ? other : one;
        }
    }

    /// To the children of a node.
    [[nodiscard]] PACKET_INLINE SlopeRanges<Isa> to(const WideNode& node) const {
        SlopeRanges<Isa> out;
        F way[2], per_way[2];
        for (int side = 0; side < 2; ++side) {
            way[side] = multiply_subtract(F::load(node.plane[side][axis_[2]]), away_, anchor_);
            per_way[side] = F(1.0f) / way[side];
        }
        out.open = min(way[0], way[1]) < F(kLeastWay);
        for (int a = 0; a < 2; ++a) {
            const F lower = F::load(node.plane[0][axis_[a]]) - offset_[a][kUpper];
            const F upper = F::load(node.plane[1][axis_[a]]) - offset_[a][kLower];
            out.least[a] = min(lower * per_way[0], lower * per_way[1]);
            out.most[a] = max(upper * per_way[0], upper * per_way[1]);
        }
        return out;
    }
    /// To the triangles of a block.
    [[nodiscard]] PACKET_INLINE SlopeRanges<Isa> to(const TriangleBlock& block) const {
        SlopeRanges<Isa> out;
        F per_way[3], nearest;
        for (int corner = 0; corner < 3; ++corner) {
            const F way = multiply_subtract(F::load(block.v[corner][axis_[2]]), away_, anchor_);
            nearest = corner == 0 ? way : min(nearest, way);
            per_way[corner] = F(1.0f) / way;
        }
        out.open = nearest < F(kLeastWay);
        for (int a = 0; a < 2; ++a) {
            for (int corner = 0; corner < 3; ++corner) {
                const F x = F::load(block.v[corner][axis_[a]]);
                const F least = (x - offset_[a][kUpper]) * per_way[corner];
                const F most = (x - offset_[a][kLower]) * per_way[corner];
                out.least[a] = corner == 0 ? least : min(out.least[a], least);
                out.most[a] = corner == 0 ? most : max(out.most[a], most);
            }
        }
        return out;
    }
    /// The triangles that rays of any packet may hit.
    [[nodiscard]] PACKET_INLINE std::uint32_t meets(const SlopeRanges<Isa>& to) const {
        return overlap(to, least_of_all_, most_of_all_);
    }
    /// The packets of which rays may meet a child.
    [[nodiscard]] PACKET_INLINE std::uint32_t packets(const SlopeRanges<Isa>& to, int child) const {
        const F least[2] = {lane_of(to.least[0], child), lane_of(to.least[1], child)};
        const F most[2] = {lane_of(to.most[0], child), lane_of(to.most[1], child)};
        std::uint32_t out = (to.open.bits() >> child & 1u) != 0 ? ~0u : 0u;
        for (int p = 0; p < kPackets; p += 8) {
            const auto x =
                (least[0] <= F::load(most_[0] + p)) & (F::load(least_[0] + p) <= most[0]);
            const auto y =
                (least[1] <= F::load(most_[1] + p)) & (F::load(least_[1] + p) <= most[1]);
            out |= (x & y).bits() << p;
        }
        return out;
    }
    /// The triangles that rays of the packet may hit.
    [[nodiscard]] PACKET_INLINE std::uint32_t meets(const SlopeRanges<Isa>& to, int p) const {
        const F least[2] = {least_[0][p], least_[1][p]}, most[2] = {most_[0][p], most_[1][p]};
        return overlap(to, least, most);
    }

private:
    using F = Float<kWideSize, Isa>;
    static constexpr float kLeastWay = 1e-30f;  // so that no product is 0 * inf

    PACKET_INLINE static std::uint32_t overlap(const SlopeRanges<Isa>& to, const F (&least)[2],
                                               const F (&most)[2]) {
        const auto x = (to.least[0] <= most[0]) & (least[0] <= to.most[0]);
        const auto y = (to.least[1] <= most[1]) & (least[1] <= to.most[1]);
        return ((x & y) | to.open).bits();
    }

    /// Of eight packets. Those that are not there, or have no active rays, have none.
    template <int N>
    PACKET_INLINE void find_slopes(int a, int first, float away, const PreparedRays<N, Isa>* rays,
                                   const BestHits<N, Isa>* best, int packet_count) {
        using Lanes = Float<N, Isa>;
        constexpr float kInfinity = __builtin_huge_valf();
        Lanes slope[8], negative[8];
        for (int i = 0; i < 8; ++i) {
            slope[i] = negative[i] = kInfinity;
            const int p = first + i;
            if (p >= packet_count) continue;
            const auto active = best[p].t > Lanes(kNever);
            const Lanes along = a == 0 ? rays[p].shear.shear_x : rays[p].shear.shear_y;
            slope[i] = select(active, along * Lanes(away), slope[i]);
            negative[i] = select(active, along * Lanes(-away), negative[i]);
        }
        float least[8], most[8];
        smallest_lanes(slope, least);
        smallest_lanes(negative, most);
        for (int i = 0; i < 8; ++i) {
            least_[a][first + i] = least[i];
            most_[a][first + i] = 0.0f - most[i];
        }
    }

    F away_, anchor_, offset_[2][kBeamSides], least_of_all_[2], most_of_all_[2];
    int axis_[3];
    float least_[2][kPackets], most_[2][kPackets];  ///< by packet
};

}  // namespace packet
