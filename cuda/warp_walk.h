// Walks a tree with the 32 rays of a warp that share one stack, as kernels/packet_walk.h does with
// a packet's: by the same steps under the same names, but on the binary form, since the boxes of
// eight children would be met one after the other as well. A lane's Float is a register of its
// thread, any() and count() are votes.
//
// All lanes of the warp go along, whether they have a ray or not: each vote is of the full warp.
//
// Guenther, Popov, Seidel, Slusallek. Realtime ray tracing on GPU with BVH-based packet traversal.
// Interactive Ray Tracing 2007.
#pragma once

#include "kernels/box.h"
#include "ray_batch.h"

namespace packet::cuda {

/// A warp's stack in shared memory: of each entry where each lane enters, and one node.
class WarpStack {
public:
    /// So many words are needed for `depth` entries.
    PACKET_INLINE static constexpr std::uint32_t words(std::uint32_t depth) {
        return depth * (kWarpSize + 1);
    }
    /// Of the warp that runs, where each warp of the block has one of `depth` entries.
    PACKET_DEVICE explicit WarpStack(std::uint32_t depth)
        : enter_(warp_in_block() * words(depth), depth * kWarpSize),
          node_(warp_in_block() * words(depth) + depth * kWarpSize, depth) {}

    PACKET_DEVICE void push(Lane enter, std::uint32_t node) {
        enter_[depth_ * kWarpSize + lane_id()] = enter.r[0];
        __syncwarp();  // the node that was here has been read
        if (lane_id() == 0) node_[depth_] = node;
        ++depth_;
    }
    PACKET_DEVICE std::uint32_t pop(Lane& enter) {
        --depth_;
        enter.r[0] = enter_[depth_ * kWarpSize + lane_id()];
        __syncwarp();  // the node is written
        return node_[depth_];
    }
    PACKET_DEVICE std::uint32_t depth() const { return depth_; }

private:
    SharedArray<float> enter_;
    SharedArray<std::uint32_t> node_;
    std::uint32_t depth_ = 0;
};

/// Where the lane enters a node's box, +inf if it misses it.
PACKET_DEVICE Lane entry(const PreparedLane& ray, const Node& node, const Lane& best_t) {
    const Interval<1, isa::CudaThread> box =
        BoxPlanes<Directions::kMixed, 1, isa::CudaThread>(node, ray.near_side).slabs(ray);
    return select(meets(ray, box, best_t), box.enter, Lane(__builtin_huge_valf()));
}

/// Lanes of the warp for which it holds.
PACKET_DEVICE unsigned vote(LaneMask1 holds) { return __ballot_sync(kFullWarp, any(holds)); }

/// Calls leaf(first, count, takes_part) for each leaf whose box a lane meets before best_t, which
/// leaf may lower. Lanes with best_t = kNever take no part. What is on the stack stays there.
template <class Stats, class Leaf>
PACKET_DEVICE void walk_tree(const TreeView& tree, const PreparedLane& ray, const Lane& best_t,
                             WarpStack& stack, Stats& stats, Leaf&& leaf) {
    const std::uint32_t bottom = stack.depth();
    std::uint32_t node_id = 0;
    Node root = load_node(tree, 0);
    Link node = {root.link, root.count};
    Lane enter = entry(ray, root, best_t);
    for (;;) {
        // enter <= best_t also drops the lanes that missed: best_t is finite
        if (vote(enter <= best_t) != 0) {
            if (!node.is_leaf()) {
                stats.visit(any(enter <= best_t));
                const Node child0 = load_node(tree, node_id + 1);
                const Node child1 = load_node(tree, node.link);
                const Lane enter0 = entry(ray, child0, best_t);
                const Lane enter1 = entry(ray, child1, best_t);
                // The lane with +inf in both has no vote, since +inf < +inf is false either way.
                const int votes0 = __popc(vote(enter0 < enter1));
                const int votes1 = __popc(vote(enter1 < enter0));
                const bool first0 = votes0 >= votes1;
                stack.push(first0 ? enter1 : enter0, first0 ? node.link : node_id + 1);
                node_id = first0 ? node_id + 1 : node.link;
                node = first0 ? Link{child0.link, child0.count} : Link{child1.link, child1.count};
                enter = first0 ? enter0 : enter1;
                continue;
            }
            leaf(node.link, node.count, enter <= best_t);
        }
        if (stack.depth() == bottom) return;
        node_id = stack.pop(enter);
        node = load_link(tree, node_id);
    }
}

}  // namespace packet::cuda
