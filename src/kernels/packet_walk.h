// Walks a binary tree with a packet of rays that share one stack. A node is visited while any lane
// is active; the child that most lanes enter first comes first; what lies behind a lane's best hit
// is culled when it is pushed and again when it is popped.
//
// Wald, Slusallek, Benthin, Wagner. Interactive rendering with coherent ray tracing. Eurographics
// 2001. Wald, Boulos, Shirley. Ray tracing deformable scenes using dynamic bounding volume
// hierarchies. TOG 2007.
#pragma once

#include "kernels/best_hit.h"
#include "kernels/box.h"

namespace packet {

/// A subtree to visit and where each lane enters it; +inf where the lane does not.
template <int N, class Isa>
struct StackEntry {
    Float<N, Isa> enter;
    std::uint32_t node;
};

/// Where lanes enter a node's box, +inf for those that miss it.
template <Directions directions, int N, class Isa>
PACKET_INLINE Float<N, Isa> entry(const PreparedRays<N, Isa>& ray, const Node& node,
                                  const Float<N, Isa>& best_t) {
    const Interval<N, Isa> box = slabs<directions>(ray, node);
    return select(meets(ray, box, best_t), box.enter, Float<N, Isa>(__builtin_huge_valf()));
}

/// Calls leaf(first, count) for each leaf whose box a lane meets before best_t, which leaf may
/// lower. Lanes with best_t = kNever take no part.
template <Directions directions, int N, class Isa, class Stats, class Leaf>
PACKET_INLINE void walk_tree(const TreeView& tree, const PreparedRays<N, Isa>& ray,
                             const Float<N, Isa>& best_t, Stats& stats, Leaf&& leaf) {
    using F = Float<N, Isa>;
    StackEntry<N, Isa> stack[kMaxDepth];
    int depth = 0;
    std::uint32_t node_id = 0;
    F enter = entry<directions>(ray, tree.nodes[0], best_t);
    for (;;) {
        // enter <= best_t also drops the lanes that missed: best_t is finite
        if (any(enter <= best_t)) {
            const Node& node = tree.nodes[node_id];
            if (!node.is_leaf()) {
                stats.visit(count(enter <= best_t), N);
                const F enter0 = entry<directions>(ray, tree.nodes[node_id + 1], best_t);
                const F enter1 = entry<directions>(ray, tree.nodes[node.link], best_t);
                // The lane with +inf in both has no vote, since +inf < +inf is false either way.
                const int votes0 = count(enter0 < enter1), votes1 = count(enter1 < enter0);
                const bool first0 = votes0 >= votes1;
                stack[depth++] = {first0 ? enter1 : enter0, first0 ? node.link : node_id + 1};
                node_id = first0 ? node_id + 1 : node.link;
                enter = first0 ? enter0 : enter1;
                continue;
            }
            leaf(node.link, node.count, enter <= best_t);
        }
        if (depth == 0) return;
        --depth;
        node_id = stack[depth].node;
        enter = stack[depth].enter;
    }
}

}  // namespace packet
