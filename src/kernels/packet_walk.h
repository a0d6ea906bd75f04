// Walks the 8-wide form of a tree with a packet of rays that share one stack. A node is visited
// while any lane is active; of the children that the packet's beam and its lanes meet, those come
// first that some lane enters first; what lies behind a lane's best hit is culled when it is pushed
// and again when it is popped. Where few lanes are active, the caller takes them one by one.
//
// Wald, Slusallek, Benthin, Wagner. Interactive rendering with coherent ray tracing. Eurographics
// 2001. Benthin, Wald, Woop, Ernst, Mark. Combining single and packet-ray tracing for arbitrary ray
// distributions on the Intel MIC architecture. TVCG 2012.
#pragma once

#include "kernels/box.h"
#include "kernels/leaf.h"
#include "kernels/prefetch.h"

namespace packet {

/// What packets in no beam may meet: all children of a node, and all triangles of a block.
struct NoBeam {
    PACKET_INLINE std::uint32_t meets(const WideNode&) const { return (1u << kWideSize) - 1; }
    PACKET_INLINE std::uint32_t meets(const TriangleBlock&) const { return (1u << kBlockSize) - 1; }
};

/// Lanes stay together to the end.
struct NeverAlone {
    static constexpr int kFewest = 0;
    template <int N, class Isa>
    PACKET_INLINE void operator()(const WideChild&, Mask<N, Isa>) const {}
};

/// A walk of the packet `ray` through `tree`. Lanes with best_t = kNever take no part.
template <Query query, Directions directions, int N, class Isa, class Stats>
class PacketWalk {
public:
    using F = Float<N, Isa>;
    using M = Mask<N, Isa>;

    PACKET_INLINE PacketWalk(const TreeView& tree, const PreparedRays<N, Isa>& ray, const F& best_t,
                             Stats& stats)
        : tree_(tree), ray_(ray), best_t_(best_t), stats_(stats) {}

    /// Calls leaf(first, count, active) for each leaf whose box a lane meets before best_t, which
    /// leaf may lower, and alone(child, active) for subtrees that fewer than its kFewest lanes
    /// meet.
    template <class BeamOrNone, class Leaf, class Alone>
    PACKET_INLINE void run(const BeamOrNone& beam, Leaf&& leaf, Alone&& alone) {
        WideChild next = {0, 0};
        M active = best_t_ > F(kNever);
        for (;;) {
            if (Alone::kFewest > 0 && count(active) < Alone::kFewest) {
                alone(next, active);
            } else if (next.is_leaf()) {
                leaf(next.link, next.count, active);
            } else if (visit(tree_.wide_nodes[next.link], beam, next, active)) {
                continue;
            }
            do {
                if (size_ == 0) return;
                --size_;
                next = stack_[size_].child;
                // drops the lanes that missed, too: best_t is finite
                active = stack_[size_].enter <= best_t_;
            } while (none(active));
        }
    }

private:
    /// A subtree to visit and where each lane enters it; +inf where the lane does not.
    struct Entry {
        F enter;
        WideChild child;
    };

    /// Pushes the children that lanes of `active` meet but for one, which is next. False if there
    /// is none.
    template <class BeamOrNone>
    PACKET_INLINE bool visit(const WideNode& node, const BeamOrNone& beam, WideChild& next,
                             M& active) {
        stats_.visit(count(active), N);
        const int bottom = size_;
        for (std::uint32_t left = beam.meets(node); left != 0; left &= left - 1) {
            const int child = __builtin_ctz(left);
            const BoxPlanes<directions, N, Isa> planes(node, child, ray_.near_side);
            const Interval<N, Isa> box = planes.slabs(ray_);
            const M met = meets(ray_, box, best_t_) & active;
            const Entry entry = {select(met, box.enter, F(__builtin_huge_valf())),
                                 node.child[child]};
            if constexpr (query == Query::kAny) {
                // No branch: whether a child is met is anybody's guess.
                prefetch(tree_, entry.child);
                stack_[size_] = entry;
                size_ += any(met) ? 1 : 0;
            } else if (any(met)) {
                prefetch(tree_, entry.child);
                push(entry, bottom);
            }
        }
        if (size_ == bottom) return false;
        --size_;
        next = stack_[size_].child;
        active = stack_[size_].enter <= best_t_;
        return true;
    }
    /// Onto those of the node's other children, from `bottom` on, that no lane enters later.
    PACKET_INLINE void push(const Entry& entry, int bottom) {
        int place = size_++;
        for (; place > bottom && none(entry.enter < stack_[place - 1].enter); --place) {
            stack_[place] = stack_[place - 1];
        }
        stack_[place] = entry;
    }

    const TreeView& tree_;
    const PreparedRays<N, Isa>& ray_;
    const F& best_t_;
    Stats& stats_;
    int size_ = 0;
    Entry stack_[kMaxDepth * (kWideSize - 1) + kWideSize];
};

}  // namespace packet
