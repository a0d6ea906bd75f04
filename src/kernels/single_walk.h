// Walks the 8-wide form of a tree with one ray: it meets 8 boxes at once, and what it meets goes
// onto the stack in order of entry. Any-hit takes the children as they come, since the first hit
// ends it.
//
// Wald, Benthin, Boulos. Getting rid of packets. Interactive Ray Tracing 2008.
// Afra, Szirmay-Kalos. Stackless multi-BVH traversal for CPU, MIC and GPU ray tracing. CGF 2014.
#pragma once

#include "kernels/best_hit.h"
#include "kernels/box.h"
#include "kernels/single_ray.h"

namespace packet {

/// A ray in all 8 lanes, with what the boxes of children need picked out by its octant.
template <class Isa>
struct WideRay {
    using F = Float<kWideSize, Isa>;
    F inv_dir[3], near_shift[3], far_shift[3], tnear;
    int near_side[3];

    PACKET_INLINE explicit WideRay(const SingleRay& ray) : tnear(ray.lanes.tnear[ray.lane]) {
        for (int a = 0; a < 3; ++a) {
            near_side[a] = ray.near_side[a];
            inv_dir[a] = ray.lanes.inv_dir[a][ray.lane];
            near_shift[a] = ray.lanes.shift[near_side[a]][a][ray.lane];
            far_shift[a] = ray.lanes.shift[1 - near_side[a]][a][ray.lane];
        }
    }
    /// Where the ray enters and leaves the children's boxes, by the quick form of box.h.
    PACKET_INLINE Interval<kWideSize, Isa> slabs(const WideNode& node) const {
        Interval<kWideSize, Isa> out;
        for (int a = 0; a < 3; ++a) {
            const F t_near =
                multiply_subtract(F::load(node.plane[near_side[a]][a]), inv_dir[a], near_shift[a]);
            const F t_far = multiply_subtract(F::load(node.plane[1 - near_side[a]][a]), inv_dir[a],
                                              far_shift[a]);
            out.enter = a == 0 ? t_near : max(out.enter, t_near);
            out.exit = a == 0 ? t_far : min(out.exit, t_far);
        }
        return out;
    }
};

/// Subtrees to visit, the nearest on top.
struct SingleStack {
    struct Entry {
        float enter;
        WideChild child;
    };
    // Each of at most kMaxDepth nodes on the way down leaves at most 7 children behind.
    Entry entries[kMaxDepth * (kWideSize - 1) + 1];
    int depth = 0;

    PACKET_INLINE void push(const WideChild& child, float enter) {
        entries[depth++] = {enter, child};
    }
    /// Pushes below the entries that are nearer, down to `bottom`. Insertion: seldom more than
    /// three children are met.
    PACKET_INLINE void insert(const WideChild& child, float enter, int bottom) {
        int place = depth++;
        for (; place > bottom && entries[place - 1].enter < enter; --place) {
            entries[place] = entries[place - 1];
        }
        entries[place] = {enter, child};
    }
    /// The nearest subtree that begins before `best_t`; false if there is none.
    PACKET_INLINE bool pop(float best_t, WideChild& out) {
        while (depth != 0) {
            const Entry& top = entries[--depth];
            if (top.enter > best_t) continue;
            out = top.child;
            return true;
        }
        return false;
    }
};

/// Takes one of the children of `bits` (not empty), for closest-hit the nearest, and pushes the
/// others: for closest-hit in order of entry, for any-hit as they come.
template <Query query, class Isa>
PACKET_INLINE WideChild descend(const WideNode& node, const Float<kWideSize, Isa>& enters,
                                std::uint32_t bits, SingleStack& stack) {
    const int first = __builtin_ctz(bits);
    bits &= bits - 1;
    if (bits == 0) return node.child[first];
    float enter[kWideSize];
    enters.store(enter);
    const int second = __builtin_ctz(bits);
    bits &= bits - 1;
    const bool swapped = query == Query::kClosest && enter[second] < enter[first];
    const int near = swapped ? second : first, far = swapped ? first : second;
    if (bits == 0) {
        stack.push(node.child[far], enter[far]);
        return node.child[near];
    }
    const int bottom = stack.depth;
    stack.push(node.child[far], enter[far]);
    stack.push(node.child[near], enter[near]);
    for (; bits != 0; bits &= bits - 1) {
        const int child = __builtin_ctz(bits);
        if constexpr (query == Query::kClosest) {
            stack.insert(node.child[child], enter[child], bottom);
        } else {
            stack.push(node.child[child], enter[child]);
        }
    }
    return stack.entries[--stack.depth].child;
}

/// Calls leaf(first, count) for each leaf whose box the ray meets before `best_t`, which leaf may
/// lower; kNever ends the walk.
template <Query query, class Isa, class Stats, class Leaf>
PACKET_INLINE void walk_wide_tree(const TreeView& tree, const SingleRay& ray, const float& best_t,
                                  Stats& stats, Leaf&& leaf) {
    using F = Float<kWideSize, Isa>;
    const WideRay<Isa> wide(ray);
    SingleStack stack;
    WideChild next = {0, 0};
    for (;;) {
        if (!next.is_leaf()) {
            const WideNode& node = tree.wide_nodes[next.link];
            stats.visit(1, 1);
            const Interval<kWideSize, Isa> boxes = wide.slabs(node);
            // if (max(enter, tnear) > min(exit, best_t)) the ray misses; equal must pass, for the
            // tie rule
            const std::uint32_t bits =
                (max(boxes.enter, wide.tnear) <= min(boxes.exit, F(best_t))).bits();
            if (bits != 0) {
                next = descend<query>(node, boxes.enter, bits, stack);
                continue;
            }
        } else {
            leaf(next.link, next.count);
            if (query == Query::kAny && best_t == kNever) return;
        }
        if (!stack.pop(best_t, next)) return;
    }
}

}  // namespace packet
