// Walks the 8-wide form of a tree with a tile: packets of rays in one beam. The beam rejects
// children and triangles eight at a time, and for what it leaves the packets' slopes tell which of
// them may meet it, again eight at a time; their exact tests leave a mask of those that are active
// below.
//
// Wald, Boulos, Shirley. Ray tracing deformable scenes using dynamic bounding volume hierarchies.
// TOG 2007. Fuetterling, Lojewski, Pfreundt, Ebert. Efficient ray tracing kernels for modern CPU
// architectures. JCGT 2015.
#pragma once

#include "kernels/beam.h"
#include "kernels/box.h"
#include "kernels/child_words.h"
#include "kernels/lone_lanes.h"
#include "kernels/packet_slopes.h"
#include "kernels/prefetch.h"

namespace packet {

/// Rays of a tile.
inline constexpr int kTileRays = 128;
template <int N>
inline constexpr int kTilePackets = kTileRays / N;

/// A child to visit, and the packets that may meet it.
struct TileEntry {
    const WideNode* node;
    std::uint32_t child;
    std::uint32_t packets;
};

/// The packets of a tile that walk together. Their directions are shared.
template <Query query, int N, class Isa, class Stats>
class TileWalk {
public:
    using F = Float<N, Isa>;
    using M = Mask<N, Isa>;

    PACKET_INLINE TileWalk(const TreeView& tree, const PreparedRays<N, Isa>* rays,
                           BestHits<N, Isa>* best, int packet_count, const BeamBounds& bounds,
                           std::int32_t instance_id, Stats& stats)
        : tree_(tree),
          rays_(rays),
          best_(best),
          beam_(bounds),
          slopes_(bounds, rays, best, packet_count),
          instance_id_(instance_id),
          stats_(stats) {
        has_origin_ = bounds.has_origin;
        for (int a = 0; a < 3; ++a) {
            near_side_[a] = rays[0].near_side[a];
            axis_[a] = bounds.axis[a];
            origin_[a] = bounds.origin[a];
        }
    }

    PACKET_INLINE void run(std::uint32_t packets) {
        looking_ = packets;
        const WideNode* node = tree_.wide_nodes;
        for (;;) {
            push_children(*node, packets);
            do {
                if (size_ == 0) return;
                const TileEntry& top = stack_[--size_];
                const WideChild child = top.node->child[top.child];
                packets = active_packets(top);
                if (packets == 0) continue;
                node = &tree_.wide_nodes[child.link];
                if (child.is_leaf()) {
                    meet_leaf({child.link, child.count}, packets);
                } else if (is_lone(packets)) {
                    walk_alone(child, __builtin_ctz(packets));
                } else {
                    count_visits(top, packets);
                    break;
                }
                if (looking_ == 0) return;
                packets = 0;
            } while (packets == 0);
        }
    }

private:
    // As few lanes of one packet go on as single rays, whose box tests are exact for each child.
    // Measured: docs/experiments.md#tiles-and-single-rays.
    static constexpr int kFewest = 3;

    [[nodiscard]] PACKET_INLINE bool is_lone(std::uint32_t packets) const {
        return (packets & (packets - 1)) == 0 && count(active_[__builtin_ctz(packets)]) < kFewest;
    }
    PACKET_NOINLINE void walk_alone(const WideChild& child, int p) {
        const auto ray_of = [&](int lane) { return PacketRay<N, Isa>{rays_[p], lane}; };
        LoneLanes<query, N, Isa, decltype(ray_of)> lanes(tree_, ray_of, instance_id_, best_[p]);
        lanes.walk(child, active_[p], stats_);
        end_if_occluded(p);
    }

    /// Pushes the children that packets may meet, for closest-hit the nearest last.
    PACKET_INLINE void push_children(const WideNode& node, std::uint32_t packets) {
        Float<kWideSize, Isa> depths;
        std::uint32_t children = beam_.meets(node, depths);
        const SlopeRanges<Isa> to = slopes_.to(node);
        const auto push = [&](int child) {
            const std::uint32_t left = packets & slopes_.packets(to, child);
            if (left != 0) prefetch(tree_, node.child[child]);
            stack_[size_] = {&node, static_cast<std::uint32_t>(child), left};
            size_ += left != 0 ? 1 : 0;
        };
        if constexpr (query == Query::kClosest) {
            const FarToNear order(depths, Mask<kWideSize, Isa>::from_bits(children));
            std::int32_t child[kWideSize];
            order.store(child);
            for (int i = 0; i < __builtin_popcount(children); ++i) push(child[i]);
        } else {
            for (; children != 0; children &= children - 1) push(__builtin_ctz(children));
        }
    }

    /// The packets to go on with: of a leaf those that meet its box, and in active_ their lanes
    /// that do; of a node for closest-hit all from the first that does, in active_ that one's,
    /// since below it they are met with smaller boxes.
    PACKET_INLINE std::uint32_t active_packets(const TileEntry& entry) {
        std::uint32_t left = entry.packets & looking_, out = 0;
        if (left == 0) return 0;
        const BoxPlanes<Directions::kShared, N, Isa> planes(
            *entry.node, static_cast<int>(entry.child), near_side_);
        const bool is_leaf = entry.node->child[entry.child].is_leaf();
        for (; left != 0; left &= left - 1) {
            const int p = __builtin_ctz(left);
            const M active = meets(rays_[p], planes.slabs(rays_[p]), best_[p].t);
            if (query == Query::kClosest && !is_leaf) {
                if (none(active)) continue;
                active_[p] = active;
                return left;
            }
            // No branch from here on: which packets meet a box is anybody's guess.
            active_[p] = active;
            out |= (any(active) ? 1u : 0u) << p;
        }
        return out;
    }
    /// Also of packets that go along without being asked whether they meet the box.
    PACKET_INLINE void count_visits(const TileEntry& entry, std::uint32_t packets) {
        if constexpr (Stats::kCounts) {
            const BoxPlanes<Directions::kShared, N, Isa> planes(
                *entry.node, static_cast<int>(entry.child), near_side_);
            for (; packets != 0; packets &= packets - 1) {
                const int p = __builtin_ctz(packets);
                const M active = meets(rays_[p], planes.slabs(rays_[p]), best_[p].t);
                if (any(active)) stats_.visit(count(active), N);
            }
        }
    }

    PACKET_INLINE void meet_leaf(BlockRange range, std::uint32_t packets) {
        for (std::uint32_t b = range.begin(); b < range.end(); ++b) {
            meet_block(tree_.blocks[b], range.lanes(b), packets);
        }
        if constexpr (query == Query::kAny) {
            for (; packets != 0; packets &= packets - 1) end_if_occluded(__builtin_ctz(packets));
        }
    }
    PACKET_INLINE void end_if_occluded(int p) {
        if (query == Query::kAny && none(best_[p].t > F(kNever))) looking_ &= ~(1u << p);
    }
    PACKET_INLINE void meet_block(const TriangleBlock& block, std::uint32_t lanes,
                                  std::uint32_t packets) {
        const SlopeRanges<Isa> to = slopes_.to(block);
        lanes &= slopes_.meets(to);
        if ((lanes & to.open.bits()) != 0) [[unlikely]]
            lanes &= beam_.meets(block);
        if (lanes == 0) return;
        if (has_origin_) {
            meet_block(block, RelativeCorners(block, origin_, axis_, Isa()), to, lanes, packets);
        } else {
            meet_block(block, BlockCorners{block}, to, lanes, packets);
        }
    }
    /// Its triangles of `lanes`, which packets first see as `corners`.
    template <class Corners>
    PACKET_INLINE void meet_block(const TriangleBlock& block, const Corners& corners,
                                  const SlopeRanges<Isa>& to, std::uint32_t lanes,
                                  std::uint32_t packets) {
        // How many packets have triangles to meet, and which way, is anybody's guess: so they are
        // sorted first.
        std::uint32_t triangles[kTilePackets<N>], together = 0, one_by_one = 0;
        for (; packets != 0; packets &= packets - 1) {
            const int p = __builtin_ctz(packets);
            triangles[p] = lanes & slopes_.meets(to, p);
            const int rays = count(active_[p]), items = __builtin_popcount(triangles[p]);
            stats_.triangles(rays * items);
            one_by_one |= (rays < items ? 1u : 0u) << p;
            together |= (0 < items && items <= rays ? 1u : 0u) << p;
        }
        for (; one_by_one != 0; one_by_one &= one_by_one - 1) {
            const int p = __builtin_ctz(one_by_one);
            leaf(p).meet_one_by_one(block, corners, triangles[p], active_[p]);
        }
        for (; together != 0; together &= together - 1) {
            const int p = __builtin_ctz(together);
            leaf(p).meet(block, corners, triangles[p], active_[p]);
        }
    }
    PACKET_INLINE PacketLeaf<query, Directions::kShared, N, Isa> leaf(int p) const {
        return {rays_[p], axis_, instance_id_, best_[p]};
    }

    const TreeView& tree_;
    const PreparedRays<N, Isa>* rays_;
    BestHits<N, Isa>* best_;
    Beam<Isa> beam_;
    PacketSlopes<kTilePackets<N>, Isa> slopes_;
    int near_side_[3], axis_[3];  ///< of all
    bool has_origin_;             ///< all start at origin_
    float origin_[3];
    std::int32_t instance_id_;
    Stats& stats_;
    std::uint32_t looking_ = 0;  ///< packets that may still find something
    M active_[kTilePackets<N>];
    int size_ = 0;
    TileEntry stack_[kMaxDepth * (kWideSize - 1) + kWideSize];
};

}  // namespace packet
