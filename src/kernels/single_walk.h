// Walks the 8-wide form of a tree with one ray: it meets 8 boxes at once, and what it meets goes
// onto the stack in order of entry. Any-hit takes the children as they come, since the first hit
// ends it.
//
// Wald, Benthin, Boulos. Getting rid of packets. Interactive Ray Tracing 2008.
// Afra, Szirmay-Kalos. Stackless multi-BVH traversal for CPU, MIC and GPU ray tracing. CGF 2014.
#pragma once

#include "kernels/best_hit.h"
#include "kernels/box.h"

namespace packet {

/// A ray in all 8 lanes, with what the boxes of children need picked out by its octant.
template <class Isa>
struct WideRay {
    using F = Float<kWideSize, Isa>;
    F org_near[3], org_far[3], inv_dir[3], tnear;
    int near_side[3];

    PACKET_INLINE explicit WideRay(const PreparedRays<kWideSize, Isa>& ray) : tnear(ray.tnear) {
        for (int a = 0; a < 3; ++a) {
            near_side[a] = ray.near_side[a];
            org_near[a] = ray.org_near[a];
            org_far[a] = ray.org_far[a];
            inv_dir[a] = ray.inv_dir[a];
        }
    }
    /// Where the ray enters and leaves the children's boxes, by the arithmetic of box.h.
    PACKET_INLINE Interval<kWideSize, Isa> slabs(const WideNode& node) const {
        Interval<kWideSize, Isa> out;
        for (int a = 0; a < 3; ++a) {
            const int near = near_side[a];
            const F t_near = (F::load(node.plane[near][a]) - org_near[a]) * inv_dir[a];
            const F t_far = (F::load(node.plane[1 - near][a]) - org_far[a]) * inv_dir[a];
            out.enter = a == 0 ? t_near : max(out.enter, t_near);
            out.exit = a == 0 ? t_far : min(out.exit, t_far);
        }
        return out;
    }
};

struct SingleEntry {
    float enter;
    std::uint32_t link, count;
};

PACKET_INLINE void put(SingleEntry& entry, const WideNode& node, int child, float enter) {
    entry.enter = enter;
    entry.link = node.link[child];
    entry.count = node.count[child];
}

/// Pushes the children of `bits`: for closest-hit the farthest first, so that the nearest is popped
/// next, by insertion, since seldom more than three are met; for any-hit as they come.
template <Query query>
PACKET_INLINE int push_children(const WideNode& node, const float* enter, std::uint32_t bits,
                                SingleEntry* stack, int depth) {
    const int bottom = depth;
    for (; bits != 0; bits &= bits - 1) {
        const int child = __builtin_ctz(bits);
        int place = depth++;
        if constexpr (query == Query::kClosest) {
            for (; place > bottom && stack[place - 1].enter < enter[child]; --place) {
                stack[place] = stack[place - 1];
            }
        }
        put(stack[place], node, child, enter[child]);
    }
    return depth;
}

/// Calls leaf(first, count) for each leaf whose box the ray meets before `best_t`, which leaf may
/// lower; kNever ends the walk.
template <Query query, class Isa, class Stats, class Leaf>
PACKET_INLINE void walk_wide_tree(const TreeView& tree, const PreparedRays<kWideSize, Isa>& ray,
                                  const float& best_t, Stats& stats, Leaf&& leaf) {
    using F = Float<kWideSize, Isa>;
    const WideRay<Isa> wide(ray);
    // Each of at most kMaxDepth nodes on the way down leaves at most 7 children behind.
    SingleEntry stack[kMaxDepth * (kWideSize - 1) + 1];
    int depth = 0;
    std::uint32_t node_id = 0;
    for (;;) {
        const WideNode& node = tree.wide_nodes[node_id];
        stats.visit(1, 1);
        const Interval<kWideSize, Isa> boxes = wide.slabs(node);
        // if (max(enter, tnear) > min(exit, best_t)) the ray misses; equal must pass, for the tie
        // rule
        const std::uint32_t bits =
            (max(boxes.enter, wide.tnear) <= min(boxes.exit, F(best_t))).bits();
        if (bits != 0) {
            float enter[kWideSize];
            boxes.enter.store(enter);
            depth = push_children<query>(node, enter, bits, stack, depth);
        }
        for (;;) {
            if (depth == 0) return;
            const SingleEntry top = stack[--depth];
            if (top.enter > best_t) continue;
            if (top.count == 0) {
                node_id = top.link;
                break;
            }
            leaf(top.link, top.count);
            if (query == Query::kAny && best_t == kNever) return;
        }
    }
}

}  // namespace packet
