// The rays of a stream, laid out for both ways in which they meet a tree: each in a line of its
// own, to meet eight boxes or triangles at once, and in packets, many of which meet one.
#pragma once

#include "kernels/beam.h"
#include "kernels/leaf.h"
#include "kernels/transpose.h"

namespace packet {

/// Rays of a stream. Sets of them are words of 64 bits; 32 rays were up to a tenth slower.
inline constexpr int kStreamRays = 64;
using RaySet = std::uint64_t;

/// What a ray needs at nodes and to filter triangles: one line of the cache. It leaves nodes by
/// ExitOrigins. Planes are numbered in the order in which the stream's rays meet them, axes in that
/// of its triangle test.
struct alignas(64) StreamRay {
    float inv_dir[3], near_shift[3], far_org[3], tnear;
    float best_t;
    float shear_org[3], shear_x, shear_y;
};
static_assert(sizeof(StreamRay) == 2 * sizeof(Floats8));

/// The rays of a stream, and for closest-hit what they have found.
template <class Isa>
struct StreamRays {
    static constexpr int N = kPacketLanes<Isa>;
    static constexpr int kPackets = kStreamRays / N;

    StreamRay ray[kStreamRays];
    PreparedRays<N, Isa> packet[kPackets];
    BestHits<N, Isa> best[kPackets];
    Beam<Isa> beam;                                     ///< around all of them
    bool has_beam = false;                              ///< else there is none
    int near_side[3] = {0, 0, 0}, axis[3] = {0, 1, 2};  ///< of all
    RaySet active = 0;

    /// Packet p, of which the rays of `used` are usable and of the stream's class.
    PACKET_INLINE void load(int p, const TreeView& tree, const RayLanes<N, Isa>& rays,
                            Mask<N, Isa> used, std::int32_t instance_id) {
        PreparedRays<N, Isa>& to = packet[p];
        prepare(to, tree, rays, used.bits());
        best[p].reset(rays.tfar, used);
        best[p].enter_instance(instance_id);
        best[p].instance_id = instance_id;
        const ExitOrigins<N, Isa> exits(to, tree, rays);
        Float<N, Isa> far_org[3];
        for (int a = 0; a < 3; ++a) far_org[a] = exits.org[1 - to.near_side[a]][a];
        for (int lane = 0; lane < N; lane += 8) {
            fill(to, far_org, best[p], lane, ray + p * N + lane);
        }
        if (none(used)) return;
        active |= RaySet{used.bits()} << p * N;
        for (int a = 0; a < 3; ++a) {
            near_side[a] = to.near_side[a];
            axis[a] = to.shear.axis[a];
        }
    }
    /// After the last of so many packets.
    PACKET_INLINE void bound(int packet_count) {
        has_beam = active != 0;
        if (!has_beam) return;
        const int first = __builtin_ctzll(active) / N;  // with a ray that tells their directions
        const BeamBounds bounds = bound_rays(packet + first, best + first, packet_count - first);
        has_beam = bounds.is_sound;
        beam = Beam<Isa>(bounds);
    }

    PACKET_INLINE PacketRay<N, Isa> one(int r) const { return {packet[r / N], r % N}; }
    /// The rays of packet p in a set.
    PACKET_INLINE static std::uint32_t part(RaySet set, int p) {
        return static_cast<std::uint32_t>(set >> p * N & ((RaySet{1} << N) - 1));
    }
    /// How many packets have rays in a set.
    PACKET_INLINE static int packets_of(RaySet set) {
        int out = 0;
        for (int p = 0; p < kPackets; ++p) out += part(set, p) != 0 ? 1 : 0;
        return out;
    }

    PACKET_INLINE std::int32_t prim_id(int r) const { return lane_of(best[r / N].prim_id, r % N); }
    PACKET_INLINE void set_prim_id(int r, std::int32_t id) {
        lane_of(best[r / N].prim_id, r % N) = id;
        lane_of(best[r / N].tie_prim_id, r % N) = id;
    }
    /// A hit that is no farther than best_t of ray r.
    PACKET_INLINE void update(int r, const BlockHit& hit) {
        if (!(hit.t < ray[r].best_t || hit.prim_id < prim_id(r))) return;
        BestHits<N, Isa>& to = best[r / N];
        ray[r].best_t = lane_of(to.t, r % N) = hit.t;
        lane_of(to.u, r % N) = hit.u;
        lane_of(to.v, r % N) = hit.v;
        set_prim_id(r, hit.prim_id);
    }

private:
    /// Columns of eight rays, from `lane` on, become their rows, in two halves.
    PACKET_INLINE static void fill(const PreparedRays<N, Isa>& from,
                                   const Float<N, Isa> (&far_org)[3], const BestHits<N, Isa>& best,
                                   int lane, StreamRay* out) {
        const auto column = [&](const Float<N, Isa>& lanes) { return &lane_of(lanes, lane); };
        const float* const columns[2][8] = {
            {column(from.inv_dir[0]), column(from.inv_dir[1]), column(from.inv_dir[2]),
             column(from.shift[0][0]), column(from.shift[0][1]), column(from.shift[0][2]),
             column(far_org[0]), column(far_org[1])},
            {column(far_org[2]), column(from.hit.tnear), column(best.t), column(from.shear.org[0]),
             column(from.shear.org[1]), column(from.shear.org[2]), column(from.shear.shear_x),
             column(from.shear.shear_y)}};
        for (int half = 0; half < 2; ++half) {
            Floats8 rows[8];
            transpose(columns[half], rows);
            for (int i = 0; i < 8; ++i) *(as_row(out + i) + half) = rows[i];
        }
    }
};

}  // namespace packet
