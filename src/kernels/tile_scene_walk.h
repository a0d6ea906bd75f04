// Traces a tile: its rays, whose directions are shared, are walked in beams as large as these
// allow, halved until they do; what fits into none goes packet by packet.
#pragma once

#include "kernels/scene_walk.h"
#include "kernels/single_scene_walk.h"
#include "kernels/tile_walk.h"

namespace packet {

/// Packets whose beam would be wider than this part of its way through the tree walk in two beams.
/// Measured: from 0.1 to 1 the speeds differ by less than their noise.
inline constexpr float kWidestBeam = 0.25f;

/// Whether the rays of both packets go into the same octant with the same longest axis.
template <int N, class Isa>
PACKET_INLINE bool share_directions(const PreparedRays<N, Isa>& one,
                                    const PreparedRays<N, Isa>& other) {
    if (other.directions == Directions::kMixed || one.shear.axis[2] != other.shear.axis[2])
        return false;
    for (int a = 0; a < 3; ++a) {
        if (one.near_side[a] != other.near_side[a]) return false;
    }
    return true;
}

/// The packets of a tile in a mesh.
template <Query query, int N, class Isa, class Stats, class Alone>
struct TileTracer {
    const TreeView& tree;
    std::int32_t instance_id;
    const PreparedRays<N, Isa>* rays;
    BestHits<N, Isa>* best;
    std::uint32_t active;  ///< packets with a lane to trace
    Stats& stats;
    Alone& alone;  ///< traces one packet

    [[gnu::noinline]] void trace(int first, int last) {
        while (first < last && (active >> first & 1u) == 0) ++first;
        while (first < last && (active >> (last - 1) & 1u) == 0) --last;
        if (first == last || walk_beam(first, last)) return;
        if (last - first == 1) {
            alone(first);
            return;
        }
        const int middle = (first + last) / 2;
        trace(first, middle);
        trace(middle, last);
    }

private:
    bool walk_beam(int first, int last) {
        const BeamBounds bounds = bound_rays(rays + first, best + first, last - first);
        const int z = bounds.axis[2];
        const float way = tree.upper[z] - tree.lower[z];
        const float length = bounds.end - bounds.begin;
        const bool is_narrow = bounds.width(length < way ? length : way) <= kWidestBeam * way;
        if (!bounds.is_sound || !is_narrow) return false;
        TileWalk<query, N, Isa, Stats> walk(tree, rays + first, best + first, last - first, bounds,
                                            instance_id, stats);
        const std::uint32_t all = (1u << (last - first)) - 1;
        walk.run(active >> first & all);
        return true;
    }
};

}  // namespace packet
