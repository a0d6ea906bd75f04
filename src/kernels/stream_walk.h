// Walks the 8-wide form of a tree with a stream: up to 64 rays of one class, which need not be near
// each other. They share the stack: an entry is a subtree and the set of rays that meet it, so a
// node is fetched once for all of them, and its planes stay in registers while ray after ray meets
// its 8 children, without a branch. Single rays mispredict about two branches a node, rays of a
// stream less than one. Where most of an any-hit stream's rays meet a node or a block of triangles,
// they meet its items one after the other instead, in packets, as far as a beam around all of them
// does.
//
// Barringer, Akenine-Moller. Dynamic ray stream traversal. TOG 2014. Fuetterling, Lojewski,
// Pfreundt, Ebert. Efficient ray tracing kernels for modern CPU architectures. JCGT 2015.
#pragma once

#include "kernels/child_words.h"
#include "kernels/prefetch.h"
#include "kernels/stream_rays.h"

namespace packet {

/// The bits of rays, as sets of them are kept while rays meet a node: for each child of it the
/// lower halves of the sets of those that meet it, and the upper halves.
struct RayBits {
    std::int32_t half[kStreamRays][2];

    PACKET_INLINE RayBits() {
        for (int r = 0; r < kStreamRays; ++r) {
            half[r][r / 32] = static_cast<std::int32_t>(1u << r % 32);
            half[r][1 - r / 32] = 0;
        }
    }
};

/// A stream on its way through a tree.
template <class Isa>
struct Stream {
    StreamRays<Isa> rays;
    RaySet looking = 0;  ///< rays that may still find something: for any-hit, that have not yet

    // Each of at most kMaxDepth nodes on the way down leaves at most 7 children behind, and eight
    // are written at a time.
    static constexpr int kStackSize = kMaxDepth * (kWideSize - 1) + kWideSize;
    /// Subtrees to visit, the next one last: each by the rays that met its box, none of which
    /// enters it before `enter` (for any-hit not known).
    int size = 0;
    alignas(64) WideChild child[kStackSize];
    RaySet set[kStackSize];
    float enter[kStackSize];
};

/// Where streams that walk all of a tree may go. Other parts keep what `rays` would enter beyond
/// them: a node, and `enter` before which none does.
struct WholeTree {
    static constexpr bool kTakesTurns = true;  ///< with other streams
    static constexpr bool holds(std::uint32_t) { return true; }
    static constexpr void leave(std::uint32_t, RaySet, float) {}
};

/// How streams walk a tree.
template <Query query, class Isa, class Stats>
class StreamWalk {
public:
    PACKET_INLINE StreamWalk(const TreeView& tree, Stats& stats) : tree_(tree), stats_(stats) {}

    /// Enters the subtree of a node with those of `entering` that are looking.
    template <class Part>
    PACKET_INLINE void start(Stream<Isa>& stream, std::uint32_t root, RaySet entering,
                             const Part&) const {
        const int bottom = stream.size;
        entering &= stream.looking;
        if (entering != 0) visit(stream, tree_.wide_nodes[root], entering);
        fetch<Part>(stream, bottom);
    }
    /// Visits what is on top of the stack; false if there is nothing.
    template <class Part>
    PACKET_INLINE bool step(Stream<Isa>& stream, Part& part) const {
        RaySet active = 0;
        while (active == 0) {
            if (stream.size == 0) return false;
            active = stream.set[--stream.size] & stream.looking;
        }
        const int bottom = stream.size;
        const WideChild child = stream.child[bottom];
        const float enter = query == Query::kClosest ? stream.enter[bottom] : 0.0f;
        if (child.is_leaf()) {
            meet_leaf(stream, {child.link, child.count}, active, enter);
        } else if (!part.holds(child.link)) {
            part.leave(child.link, active, enter);
        } else {
            visit(stream, tree_.wide_nodes[child.link], active);
        }
        fetch<Part>(stream, bottom);
        return true;
    }
    /// Walks what is below a node in the part.
    template <class Part>
    PACKET_INLINE void walk(Stream<Isa>& stream, std::uint32_t root, RaySet entering,
                            Part& part) const {
        start(stream, root, entering, part);
        while (step(stream, part)) {
        }
    }

private:
    using F = Float<kWideSize, Isa>;
    using I = Int<kWideSize, Isa>;
    using Words = ChildWords<Isa>;
    static constexpr int N = kPacketLanes<Isa>;
    using Lanes = Float<N, Isa>;

    // Fewer rays are not worth asking the beam. Measured: docs/experiments.md#streams.
    static constexpr int kFewestForBoxes = kStreamRays / 2 + 1;
    static constexpr int kFewestForTriangles = kStreamRays / 4 + 1;

    /// Whether packets had better meet so many boxes or triangles one by one than each of the rays
    /// all of them at once: a packet and one take about as long as a ray and eight.
    PACKET_INLINE static bool is_for_packets(RaySet active, std::uint32_t items) {
        return __builtin_popcount(items) * StreamRays<Isa>::packets_of(active) <=
               __builtin_popcountll(active);
    }

    /// The planes of a node's children, in the order in which they are met.
    struct NodePlanes {
        F near[3], far[3];

        PACKET_INLINE NodePlanes(const WideNode& node, const int (&near_side)[3]) {
            for (int a = 0; a < 3; ++a) {
                near[a] = F::load(node.plane[near_side[a]][a]);
                far[a] = F::load(node.plane[1 - near_side[a]][a]);
            }
        }
        /// The children that the ray meets; in `enter` where.
        PACKET_INLINE Mask<kWideSize, Isa> meets(const StreamRay& ray, F& enter) const {
            F exit(ray.best_t);
            enter = ray.tnear;
            for (int a = 0; a < 3; ++a) {
                const F inv_dir(ray.inv_dir[a]);
                enter = max(multiply_subtract(near[a], inv_dir, F(ray.near_shift[a])), enter);
                exit = min((far[a] - F(ray.far_org[a])) * inv_dir, exit);
            }
            // if (enter > exit) the ray misses; equal must pass, for the tie rule
            return enter <= exit;
        }
    };

    PACKET_INLINE void visit(Stream<Isa>& stream, const WideNode& node, RaySet active) const {
        const StreamRays<Isa>& rays = stream.rays;
        const int count = __builtin_popcountll(active);
        if constexpr (query == Query::kAny) {
            if (count >= kFewestForBoxes && rays.has_beam) {
                const std::uint32_t children = rays.beam.meets(node);
                if (is_for_packets(active, children)) {
                    stats_.visit(count, rays.packets_of(active) * N);
                    visit_by_packets(stream, node, children, active);
                    return;
                }
            }
        }
        stats_.visit(count, count);
        visit_by_rays(stream, node, active);
    }

    /// Each ray meets all children at once.
    PACKET_INLINE void visit_by_rays(Stream<Isa>& stream, const WideNode& node,
                                     RaySet active) const {
        const NodePlanes planes(node, stream.rays.near_side);
        I found[2] = {I(0), I(0)};
        F first_enter(__builtin_huge_valf());
        for (RaySet left = active; left != 0; left &= left - 1) {
            const int r = __builtin_ctzll(left);
            F enter;
            const auto meets = planes.meets(stream.rays.ray[r], enter);
            for (int i = 0; i < 2; ++i) {
                found[i] = found[i] | select(meets, I(bits_.half[r][i]), I(0));
            }
            if constexpr (query == Query::kClosest) {
                first_enter = select(meets, min(enter, first_enter), first_enter);
            }
        }
        const auto met = ~((found[0] | found[1]) == I(0));
        const std::uint32_t children = met.bits() & ((1u << kWideSize) - 1);
        if (children == 0) return;
        // For closest-hit the nearest comes last; any-hit takes them as they come.
        const int top = stream.size;
        if constexpr (query == Query::kClosest) {
            const FarToNear order(first_enter, met);
            Words(node.child).store(order, stream.child + top);
            Words(found[0], found[1]).store(order, stream.set + top);
            __builtin_memcpy(stream.enter + top, order.enter, sizeof(order.enter));
        } else {
            Words(node.child).store(children, stream.child + top);
            Words(found[0], found[1]).store(children, stream.set + top);
        }
        stream.size += __builtin_popcount(children);
    }
    /// For any-hit: each packet of rays meets one child after the other, of those that the beam
    /// meets.
    PACKET_INLINE void visit_by_packets(Stream<Isa>& stream, const WideNode& node,
                                        std::uint32_t children, RaySet active) const {
        const StreamRays<Isa>& rays = stream.rays;
        for (; children != 0; children &= children - 1) {
            const int child = __builtin_ctz(children);
            const BoxPlanes<Directions::kShared, N, Isa> planes(node, child, rays.near_side);
            RaySet set = 0;
            for (int p = 0; p < rays.kPackets; ++p) {
                if (rays.part(active, p) == 0) continue;
                const PreparedRays<N, Isa>& packet = rays.packet[p];
                set |= RaySet{meets(packet, planes.slabs(packet), rays.best[p].t).bits()} << p * N;
            }
            set &= active;
            stream.child[stream.size] = node.child[child];
            stream.set[stream.size] = set;
            stream.size += set != 0 ? 1 : 0;
        }
    }
    /// What is visited next arrives while other streams take their steps. More would take turns
    /// with the rays for the few lines that can be on their way. A stream that is alone fetches all
    /// that was pushed, from `bottom` on.
    template <class Part>
    PACKET_INLINE void fetch(const Stream<Isa>& stream, int bottom) const {
        if constexpr (Part::kTakesTurns) {
            if (stream.size != 0) prefetch(tree_, stream.child[stream.size - 1]);
        } else {
            for (int i = bottom; i < stream.size; ++i) prefetch(tree_, stream.child[i]);
        }
    }

    PACKET_INLINE void meet_leaf(Stream<Isa>& stream, BlockRange range, RaySet active,
                                 float enter) const {
        for (std::uint32_t b = range.begin(); b < range.end(); ++b) {
            if constexpr (query == Query::kAny) {
                occlude(stream, active & stream.looking, tree_.blocks[b], range.lanes(b));
            } else {
                const int triangles = __builtin_popcount(range.lanes(b));
                meet_block(stream, active, enter, tree_.blocks[b], triangles);
            }
        }
    }
    /// Those that hit a triangle stop looking.
    PACKET_INLINE void occlude(Stream<Isa>& stream, RaySet active, const TriangleBlock& block,
                               std::uint32_t lanes) const {
        if (__builtin_popcountll(active) >= kFewestForTriangles && stream.rays.has_beam) {
            const std::uint32_t triangles = lanes & stream.rays.beam.meets(block);
            if (is_for_packets(active, triangles)) {
                occlude_by_packets(stream, active, block, triangles);
                return;
            }
        }
        occlude_by_rays(stream, active, block, __builtin_popcount(lanes));
    }

    /// Each packet of rays meets one triangle after the other.
    PACKET_INLINE void occlude_by_packets(Stream<Isa>& stream, RaySet active,
                                          const TriangleBlock& block,
                                          std::uint32_t triangles) const {
        if (triangles == 0) return;
        StreamRays<Isa>& rays = stream.rays;
        for (int p = 0; p < rays.kPackets; ++p) {
            const std::uint32_t lanes = rays.part(active, p);
            if (lanes == 0) continue;
            stats_.triangles(__builtin_popcount(lanes) * __builtin_popcount(triangles));
            BestHits<N, Isa>& best = rays.best[p];
            const auto mask = Mask<N, Isa>::from_bits(lanes);
            const std::int32_t any_instance = 0;
            const PacketLeaf<query, Directions::kShared, N, Isa> leaf{rays.packet[p], rays.axis,
                                                                      any_instance, best};
            leaf.meet(block, triangles, mask);
            const std::uint32_t hit = (~(best.t > Lanes(kNever))).bits() & lanes;
            stream.looking &= ~(RaySet{hit} << p * N);
        }
    }

    /// For closest-hit: each ray meets all triangles at once.
    PACKET_INLINE void meet_block(Stream<Isa>& stream, RaySet active, float enter,
                                  const TriangleBlock& block, int triangles) const {
        StreamRays<Isa>& rays = stream.rays;
        for (RaySet left = active; left != 0; left &= left - 1) {
            const int r = __builtin_ctzll(left);
            const StreamRay& ray = rays.ray[r];
            if (enter > ray.best_t) continue;
            stats_.triangles(triangles);
            packet::meet_block(shear_of(rays, r), rays.one(r), ray.best_t, block,
                               [&](const BlockHit& hit) { rays.update(r, hit); });
        }
    }
    /// Each ray meets all triangles at once. Which ones hit one of those that may is added up, not
    /// branched on: it is anybody's guess.
    PACKET_INLINE void occlude_by_rays(Stream<Isa>& stream, RaySet active,
                                       const TriangleBlock& block, int triangles) const {
        const StreamRays<Isa>& rays = stream.rays;
        RaySet hit = 0, open = 0;
        for (RaySet left = active; left != 0; left &= left - 1) {
            const int r = __builtin_ctzll(left);
            stats_.triangles(triangles);
            const auto sheared =
                shear<Directions::kShared>(shear_of(rays, r), BlockTriangles{block});
            const auto candidates = sheared.may_hit();
            if (none(candidates)) continue;
            const Occluders found =
                find_occluders(sheared, candidates, rays.one(r), rays.ray[r].best_t);
            hit |= RaySet{found.sure != 0} << r;
            open |= RaySet{found.possible != 0} << r;
        }
        for (RaySet left = open & ~hit; left != 0; left &= left - 1) {  // rare
            const int r = __builtin_ctzll(left);
            if (is_occluded(shear_of(rays, r), rays.one(r), rays.ray[r].best_t, block)) {
                hit |= RaySet{1} << r;
            }
        }
        stream.looking &= ~hit;
    }

    PACKET_INLINE static ShearRays<kBlockSize, Isa> shear_of(const StreamRays<Isa>& rays, int r) {
        const StreamRay& ray = rays.ray[r];
        ShearRays<kBlockSize, Isa> shear;
        for (int a = 0; a < 3; ++a) {
            shear.org[a] = ray.shear_org[a];
            shear.axis[a] = rays.axis[a];
        }
        shear.shear_x = ray.shear_x;
        shear.shear_y = ray.shear_y;
        return shear;
    }

    const TreeView& tree_;
    Stats& stats_;
    const RayBits bits_;
};

}  // namespace packet
