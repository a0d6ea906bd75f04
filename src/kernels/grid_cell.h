// What happens in a cell of a grid: its triangles are met, or its tree is walked. A triangle that
// lies in several cells is met in the first; later ones find it in the mailbox.
//
// Amanatides, Woo. A fast voxel traversal algorithm for ray tracing. Eurographics 1987 (mailbox).
#pragma once

#include "kernels/leaf.h"
#include "kernels/packet_walk.h"
#include "kernels/single_walk.h"

namespace packet {

/// The triangles that a ray, or a packet, met last. Each has one place, which it shares with
/// others: one that was displaced is met again, which changes no hit.
template <class Isa>
struct Mailbox {
    static constexpr int kSize = 64;  // larger ones find little more, and are cleared for each ray
    std::int32_t prim_id[kSize];

    PACKET_INLINE Mailbox() {
        for (std::int32_t& id : prim_id) id = -1;
    }
    /// Notes the triangle and returns whether it was there.
    PACKET_INLINE bool knows(std::int32_t id) {
        std::int32_t& place = prim_id[id & (kSize - 1)];
        const bool known = place == id;
        place = id;
        return known;
    }
};

/// The arrays of a cell's tree, as a tree.
PACKET_INLINE TreeView tree_of_cell(const TreeView& tree, const GridCell& cell) {
    const GridTree& begin = tree.grid.trees[cell.first];
    TreeView out = {};
    out.nodes = tree.nodes + begin.node;
    out.wide_nodes = tree.wide_nodes + begin.wide_node;
    out.blocks = tree.blocks + begin.block;
    return out;
}

/// A single ray meets the blocks of `count` items, but those whose items it all has met.
template <Query query, class Isa, class Stats>
[[gnu::noinline]] void meet_items(const TreeView& tree, const SingleRay& ray, std::uint32_t first,
                                  std::uint32_t count, std::int32_t instance_id,
                                  Mailbox<Isa>& mailbox, BestHits<1, Isa>& best, Stats& stats) {
    const SingleLeaf<query, Isa> leaf{tree, ray, instance_id, best};
    const std::uint32_t end = first + count;
    while (first < end) {
        const TriangleBlock& block = tree.blocks[first / kBlockSize];
        const std::uint32_t next = (first / kBlockSize + 1) * kBlockSize;
        const std::uint32_t block_end = next < end ? next : end;
        bool all_known = true;
        for (std::uint32_t i = first; i < block_end; ++i) {
            all_known &= mailbox.knows(block.prim_id[i % kBlockSize]);
        }
        if (!all_known) {
            stats.triangles(static_cast<int>(block_end - first));
            leaf.meet(BlockRange{first, block_end - first});
        }
        first = next;
    }
}

template <Query query, class Isa, class Stats>
PACKET_INLINE void meet_cell(const TreeView& tree, const GridCell& cell, const SingleRay& ray,
                             std::int32_t instance_id, Mailbox<Isa>& mailbox,
                             BestHits<1, Isa>& best, Stats& stats) {
    if (cell.count != 0) {
        meet_items<query>(tree, ray, cell.first, cell.count, instance_id, mailbox, best, stats);
        return;
    }
    const TreeView subtree = tree_of_cell(tree, cell);
    walk_wide_tree<query, Isa>(
        subtree, ray, best.t.r[0], stats, [&](std::uint32_t first, std::uint32_t count) {
            meet_items<query>(subtree, ray, first, count, instance_id, mailbox, best, stats);
        });
}

/// A packet meets those of `item_count` items that it has not met. What it meets it meets with all
/// lanes. (A function of its own, since lists and trees both come here.)
template <Query query, Directions directions, int N, class Isa, class Stats>
[[gnu::noinline]] void meet_items(const TreeView& tree, const PreparedRays<N, Isa>& ray,
                                  std::uint32_t first, std::uint32_t item_count, int lane_count,
                                  std::int32_t instance_id, Mailbox<Isa>& mailbox,
                                  BestHits<N, Isa>& best, Stats& stats) {
    const PacketLeaf<query, directions, N, Isa> leaf{ray, ray.shear.axis, instance_id, best};
    for (std::uint32_t i = first; i < first + item_count; ++i) {
        const TriangleBlock& block = tree.blocks[i / kBlockSize];
        if (mailbox.knows(block.prim_id[i % kBlockSize])) continue;
        stats.triangles(lane_count);
        leaf.meet(block, 1u << i % kBlockSize, best.t > Float<N, Isa>(kNever));
    }
}

template <Query query, Directions directions, int N, class Isa, class Stats>
PACKET_INLINE void meet_cell_directed(const TreeView& tree, const GridCell& cell,
                                      const PreparedRays<N, Isa>& ray, Mask<N, Isa> active,
                                      std::int32_t instance_id, Mailbox<Isa>& mailbox,
                                      BestHits<N, Isa>& best, Stats& stats) {
    if (cell.count != 0) {
        meet_items<query, directions>(tree, ray, cell.first, cell.count, count(active), instance_id,
                                      mailbox, best, stats);
        return;
    }
    const TreeView subtree = tree_of_cell(tree, cell);
    PacketWalk<query, directions, N, Isa, Stats> walk(subtree, ray, best.t, stats);
    walk.run(
        NoBeam{},
        [&](std::uint32_t first, std::uint32_t item_count, Mask<N, Isa> in_leaf) {
            meet_items<query, directions>(subtree, ray, first, item_count, count(in_leaf),
                                          instance_id, mailbox, best, stats);
        },
        NeverAlone{});
}

template <Query query, int N, class Isa, class Stats>
PACKET_INLINE void meet_cell(const TreeView& tree, const GridCell& cell,
                             const PreparedRays<N, Isa>& ray, Mask<N, Isa> active,
                             std::int32_t instance_id, Mailbox<Isa>& mailbox,
                             BestHits<N, Isa>& best, Stats& stats) {
    if (ray.directions == Directions::kShared) {
        meet_cell_directed<query, Directions::kShared>(tree, cell, ray, active, instance_id,
                                                       mailbox, best, stats);
    } else {
        meet_cell_directed<query, Directions::kMixed>(tree, cell, ray, active, instance_id, mailbox,
                                                      best, stats);
    }
}

}  // namespace packet
