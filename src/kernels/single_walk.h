// Walks the 8-wide form of a tree with one ray: it meets 8 boxes at once, and what it meets goes
// onto the stack in order of entry. Any-hit takes the children as they come, since the first hit
// ends it.
//
// Wald, Benthin, Boulos. Getting rid of packets. Interactive Ray Tracing 2008.
// Afra, Szirmay-Kalos. Stackless multi-BVH traversal for CPU, MIC and GPU ray tracing. CGF 2014.
#pragma once

#include "kernels/best_hit.h"
#include "kernels/box.h"
#include "kernels/prefetch.h"
#include "kernels/single_ray.h"

namespace packet {

/// How a ray leaves boxes of nodes: docs/decisions/box-slack.md.
enum class Exits { kContract, kQuick };

/// A ray in all 8 lanes, as the boxes of children need it.
template <class Isa, Exits exits>
class WideRay {
public:
    using F = Float<kWideSize, Isa>;

    PACKET_INLINE explicit WideRay(const SingleRay& ray) : tnear_(ray.tnear) {
        static_assert(exits == Exits::kContract);
        for (int a = 0; a < 3; ++a) {
            inv_dir_[a] = ray.inv_dir[a];
            near_shift_[a] = ray.near_shift[a];
            far_[a] = ray.far_org[a];
            near_planes_[a] = ray.near_planes[a];
            far_planes_[a] = ray.far_planes[a];
        }
    }
    template <int N>
    PACKET_INLINE explicit WideRay(const PacketRay<N, Isa>& ray)
        : tnear_(ray(ray.packet.hit.tnear)) {
        static_assert(exits == Exits::kQuick);
        for (int a = 0; a < 3; ++a) {
            const std::ptrdiff_t near_side = ray.packet.near_side[a];
            inv_dir_[a] = ray(ray.packet.inv_dir[a]);
            near_shift_[a] = ray(ray.packet.shift[0][a]);
            far_[a] = ray(ray.packet.shift[1][a]);
            near_planes_[a] = (3 * near_side + a) * kWideSize;
            far_planes_[a] = (3 * (1 - near_side) + a) * kWideSize;
        }
    }
    /// The children whose boxes the ray meets before `best_t`, and where it enters them by the
    /// quick form of box.h.
    PACKET_INLINE std::uint32_t meets(const WideNode& node, const F& best_t, F& enter) const {
        const float* planes = node.plane[0][0];
        F exit = best_t;
        for (int a = 0; a < 3; ++a) {
            const F near = F::load(planes + near_planes_[a]);
            const F far = F::load(planes + far_planes_[a]);
            const F t_near = multiply_subtract(near, inv_dir_[a], near_shift_[a]);
            enter = a == 0 ? t_near : max(enter, t_near);
            if constexpr (exits == Exits::kContract) {
                exit = min((far - far_[a]) * inv_dir_[a], exit);
            } else {
                exit = min(multiply_subtract(far, inv_dir_[a], far_[a]), exit);
            }
        }
        // if (max(enter, tnear) > exit) it misses; equal must pass, for the tie rule
        return (max(enter, tnear_) <= exit).bits();
    }

private:
    F inv_dir_[3], near_shift_[3], tnear_;
    F far_[3];  ///< the origin that the ray leaves boxes by, or the shift
    std::ptrdiff_t near_planes_[3], far_planes_[3];
};

template <class Isa>
PACKET_INLINE auto wide(const SingleRay& ray) {
    return WideRay<Isa, Exits::kContract>(ray);
}
template <class Isa, int N>
PACKET_INLINE auto wide(const PacketRay<N, Isa>& ray) {
    return WideRay<Isa, Exits::kQuick>(ray);
}

/// Subtrees to visit, the nearest on top.
class SingleStack {
public:
    PACKET_INLINE SingleStack() { entries_[0].enter = kNever; }

    PACKET_INLINE void push(const WideChild& child, float enter) {
        ++top_;
        top_->child = child;
        top_->enter = enter;
    }
    /// The nearest subtree that begins before `best_t`; false if there is none.
    PACKET_INLINE bool pop(float best_t, WideChild& out) {
        while (top_->enter > best_t) --top_;  // ends at the lowest, which begins before all
        if (top_ == entries_) return false;
        out = top_->child;
        --top_;
        return true;
    }

private:
    struct Entry {
        WideChild child;
        float enter;
        std::uint32_t unused;  // so that an entry moves as one
    };
    Entry* top_ = entries_;
    // Each of at most kMaxDepth nodes on the way down leaves at most 7 children behind; below them
    // lies what ends the walk.
    Entry entries_[kMaxDepth * (kWideSize - 1) + 2];
};

/// A child by its entry, in a word that is less the nearer it is; the last bits tell which it is.
PACKET_INLINE std::int32_t child_key(const float (&enter)[kWideSize], int child) {
    return (__builtin_bit_cast(std::int32_t, enter[child]) & -kWideSize) | child;
}
PACKET_INLINE void order(std::int32_t& a, std::int32_t& b) {
    const std::int32_t less = a < b ? a : b, more = a < b ? b : a;
    a = less, b = more;
}

/// Takes one of the children of `bits` (not empty), for closest-hit the nearest, and pushes the
/// others. For any-hit these are seldom come to soon enough to be worth fetching.
template <Query query, class Isa>
PACKET_INLINE WideChild descend(const TreeView& tree, const WideNode& node,
                                const Float<kWideSize, Isa>& enters, std::uint32_t bits,
                                SingleStack& stack) {
    float enter[kWideSize];
    const auto push = [&](std::int32_t key) {
        const int child = key & (kWideSize - 1);
        if constexpr (query == Query::kClosest) prefetch(tree, node.child[child]);
        stack.push(node.child[child], enter[child]);
    };
    const int first = __builtin_ctz(bits);
    bits &= bits - 1;
    if (bits == 0) return node.child[first];
    enters.store(enter);
    if constexpr (query == Query::kAny) {
        int last = first;
        for (; bits != 0; bits &= bits - 1) {
            push(last);
            last = __builtin_ctz(bits);
        }
        return node.child[last];
    }
    std::int32_t near = child_key(enter, first), far = child_key(enter, __builtin_ctz(bits));
    order(near, far);
    for (bits &= bits - 1; bits != 0; bits &= bits - 1) {
        std::int32_t next = child_key(enter, __builtin_ctz(bits));
        order(far, next);
        order(near, far);
        push(next);
    }
    push(far);
    return node.child[near & (kWideSize - 1)];
}

/// Calls leaf(first, count) for each leaf of the subtree of `next` whose box the ray meets before
/// `best_t`, which leaf may lower; kNever ends the walk.
template <Query query, class Isa, class Ray, class Stats, class Leaf>
PACKET_INLINE void walk_wide_tree(const TreeView& tree, const Ray& ray, const float& best_t,
                                  Stats& stats, Leaf&& leaf, WideChild next = {0, 0}) {
    using F = Float<kWideSize, Isa>;
    SingleStack stack;
    for (;;) {
        // Read anew after leaves, which need all registers.
        const auto wide_ray = wide<Isa>(opaque(ray));
        const F farthest(best_t);
        while (!next.is_leaf()) {
            const WideNode& node = tree.wide_nodes[next.link];
            stats.visit(1, 1);
            F enter;
            const std::uint32_t bits = wide_ray.meets(node, farthest, enter);
            if (bits != 0) {
                next = descend<query>(tree, node, enter, bits, stack);
            } else if (!stack.pop(best_t, next)) {
                return;
            }
        }
        do {
            leaf(next.link, next.count);
            if (query == Query::kAny && best_t == kNever) return;
            if (!stack.pop(best_t, next)) return;
        } while (next.is_leaf());
    }
}

}  // namespace packet
