// Walks the 8-wide form of a tree with a stream: up to 64 rays of one class, not close enough to
// share a beam or a packet. They share the stack: an entry is a subtree and the set of rays that
// meet it, so a node is fetched once for all of them, and its planes stay in registers while ray
// after ray meets its 8 children, without a branch. Single rays mispredict about two branches a
// node, rays of a stream less than one.
//
// Barringer, Akenine-Moller. Dynamic ray stream traversal. TOG 2014. Fuetterling, Lojewski,
// Pfreundt, Ebert. Efficient ray tracing kernels for modern CPU architectures. JCGT 2015.
#pragma once

#include "kernels/leaf.h"
#include "kernels/prefetch.h"
#include "kernels/transpose.h"

namespace packet {

/// Rays of a stream. Sets of them are words of 64 bits; 32 rays were up to a tenth slower.
inline constexpr int kStreamRays = 64;
using RaySet = std::uint64_t;

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

/// What a ray needs at nodes and to filter triangles: one line of the cache. Planes are numbered in
/// the order in which the stream's rays meet them, axes in that of its triangle test.
struct alignas(64) StreamRay {
    float inv_dir[3], near_shift[3], far_shift[3], tnear;
    float best_t;
    float shear_org[3], shear_x, shear_y;
};
static_assert(sizeof(StreamRay) == 2 * sizeof(Floats8));

/// What the rays of a stream have found. A prim_id of kNoId: nothing.
struct StreamHits {
    alignas(32) float t[kStreamRays];
    float u[kStreamRays], v[kStreamRays];
    std::int32_t prim_id[kStreamRays];
};

/// The rays of a stream, and for closest-hit what they have found.
template <class Isa>
struct StreamRays {
    StreamRay ray[kStreamRays];
    StreamHits hits;
    PreparedLanes lanes[kStreamRays / kSingleLanes];
    int near_side[3] = {0, 0, 0}, axis[3] = {0, 1, 2};  ///< of all
    RaySet active = 0;

    /// Rays `first` to `first + 8`, of which `used` are usable and of the stream's class.
    PACKET_INLINE void load(const TreeView& tree, const RayLanes<kSingleLanes, Isa>& rays,
                            std::uint32_t used, int first) {
        PreparedLanes& from = lanes[first / kSingleLanes];
        prepare_lanes(tree, rays, from);
        if (used != 0) {
            const SingleRay any_ray(from, __builtin_ctz(used));
            for (int a = 0; a < 3; ++a) {
                near_side[a] = any_ray.is_backward(a) ? 1 : 0;
                axis[a] = any_ray.index(PreparedLanes::kAxis + a);
            }
        }
        active |= RaySet{used} << first;
        const BestHits<kSingleLanes, Isa> none_yet(rays.tfar,
                                                   Mask<kSingleLanes, Isa>::from_bits(used));
        none_yet.t.store(hits.t + first);
        none_yet.u.store(hits.u + first);
        none_yet.v.store(hits.v + first);
        none_yet.prim_id.store(hits.prim_id + first);
        fill(from, hits.t + first, ray + first);
    }

    PACKET_INLINE SingleRay single(int r) const {
        return SingleRay(lanes[r / kSingleLanes], r % kSingleLanes);
    }

private:
    /// Columns of eight rays become their rows, in two halves.
    PACKET_INLINE static void fill(const PreparedLanes& from, const float* best_t, StreamRay* out) {
        using L = PreparedLanes;
        const auto row = [&](int number) { return from.number[number]; };
        const float* const columns[2][8] = {
            {row(L::kInvDir), row(L::kInvDir + 1), row(L::kInvDir + 2), row(L::kNearShift),
             row(L::kNearShift + 1), row(L::kNearShift + 2), row(L::kFarShift),
             row(L::kFarShift + 1)},
            {row(L::kFarShift + 2), row(L::kTnear), best_t, row(L::kShearOrg),
             row(L::kShearOrg + 1), row(L::kShearOrg + 2), row(L::kShearX), row(L::kShearY)}};
        for (int half = 0; half < 2; ++half) {
            Floats8 rows[8];
            for (int i = 0; i < 8; ++i) rows[i] = *as_row(columns[half][i]);
            transpose(rows);
            for (int i = 0; i < 8; ++i) *(as_row(out + i) + half) = rows[i];
        }
    }
};

/// A subtree to visit, by the rays that met its box. None enters it before `enter`.
struct StreamEntry {
    WideChild child;
    RaySet rays;
    float enter;
};

/// A stream on its way through a tree.
template <class Isa>
struct Stream {
    StreamRays<Isa> rays;
    RaySet looking = 0;  ///< rays that may still find something: for any-hit, that have not yet
    int size = 0;
    // Each of at most kMaxDepth nodes on the way down leaves at most 7 children behind.
    StreamEntry stack[kMaxDepth * (kWideSize - 1) + kWideSize];
};

/// Where streams that walk all of a tree may go. Other parts keep what `rays` would enter beyond
/// them: a node, and `enter` before which none does.
struct WholeTree {
    static constexpr bool holds(std::uint32_t) { return true; }
    static constexpr void leave(std::uint32_t, RaySet, float) {}
};

/// How streams walk a tree.
template <Query query, class Isa, class Stats>
class StreamWalk {
public:
    PACKET_INLINE StreamWalk(const TreeView& tree, Stats& stats) : tree_(tree), stats_(stats) {}

    /// Enters the subtree of a node with those of `entering` that are looking.
    PACKET_INLINE void start(Stream<Isa>& stream, std::uint32_t root, RaySet entering) const {
        entering &= stream.looking;
        if (entering != 0) visit(stream, tree_.wide_nodes[root], entering);
    }
    /// Visits what is on top of the stack; false if there is nothing. What it pushes is fetched,
    /// and arrives while other streams take their steps.
    template <class Part>
    PACKET_INLINE bool step(Stream<Isa>& stream, Part& part) const {
        RaySet active = 0;
        const StreamEntry* top = nullptr;
        while (active == 0) {
            if (stream.size == 0) return false;
            top = &stream.stack[--stream.size];
            active = top->rays & stream.looking;
        }
        if (top->child.is_leaf()) {
            meet_leaf(stream, {top->child.link, top->child.count}, active, top->enter);
        } else if (!part.holds(top->child.link)) {
            part.leave(top->child.link, active, top->enter);
        } else {
            visit(stream, tree_.wide_nodes[top->child.link], active);
        }
        return true;
    }
    /// Walks what is below a node in the part.
    template <class Part>
    PACKET_INLINE void walk(Stream<Isa>& stream, std::uint32_t root, RaySet entering,
                            Part& part) const {
        start(stream, root, entering);
        while (step(stream, part)) {
        }
    }

private:
    using F = Float<kWideSize, Isa>;
    using I = Int<kWideSize, Isa>;

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
            F exit;
            enter = ray.tnear;
            for (int a = 0; a < 3; ++a) {
                const F inv_dir(ray.inv_dir[a]);
                const F t_far = multiply_subtract(far[a], inv_dir, F(ray.far_shift[a]));
                enter = max(multiply_subtract(near[a], inv_dir, F(ray.near_shift[a])), enter);
                exit = a == 0 ? t_far : min(exit, t_far);
            }
            // if (enter > min(exit, best_t)) the ray misses; equal must pass, for the tie rule
            return enter <= min(exit, F(ray.best_t));
        }
    };

    PACKET_INLINE void visit(Stream<Isa>& stream, const WideNode& node, RaySet active) const {
        stats_.visit(__builtin_popcountll(active), __builtin_popcountll(active));
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
        const std::uint32_t all = (1u << kWideSize) - 1;
        push(stream, node, all & ~((found[0] | found[1]) == I(0)).bits(), found, first_enter);
    }

    /// Pushes the children of `bits`, for closest-hit the one that is entered first last. Any-hit
    /// takes them as they come.
    PACKET_INLINE void push(Stream<Isa>& stream, const WideNode& node, std::uint32_t bits,
                            const I (&found)[2], const F& first_enter) const {
        if (bits == 0) return;
        std::int32_t half[2][kWideSize];
        found[0].store(half[0]), found[1].store(half[1]);
        float enter[kWideSize];
        first_enter.store(enter);
        const int bottom = stream.size;
        for (; bits != 0; bits &= bits - 1) {
            const int child = __builtin_ctz(bits);
            const RaySet set = static_cast<std::uint32_t>(half[0][child]) |
                               RaySet{static_cast<std::uint32_t>(half[1][child])} << 32;
            prefetch(tree_, node.child[child]);
            int place = stream.size++;
            if constexpr (query == Query::kClosest) {
                for (; place > bottom && stream.stack[place - 1].enter < enter[child]; --place) {
                    stream.stack[place] = stream.stack[place - 1];
                }
            }
            stream.stack[place] = {node.child[child], set, enter[child]};
        }
    }

    PACKET_INLINE void meet_leaf(Stream<Isa>& stream, BlockRange range, RaySet active,
                                 float enter) const {
        for (std::uint32_t b = range.begin(); b < range.end(); ++b) {
            const int triangles = __builtin_popcount(range.lanes(b));
            if constexpr (query == Query::kAny) {
                occlude(stream, active & stream.looking, tree_.blocks[b], triangles);
            } else {
                meet_block(stream, active, enter, tree_.blocks[b], triangles);
            }
        }
    }

    PACKET_INLINE void meet_block(Stream<Isa>& stream, RaySet active, float enter,
                                  const TriangleBlock& block, int triangles) const {
        StreamRays<Isa>& rays = stream.rays;
        for (RaySet left = active; left != 0; left &= left - 1) {
            const int r = __builtin_ctzll(left);
            StreamRay& ray = rays.ray[r];
            if (enter > ray.best_t) continue;
            stats_.triangles(triangles);
            packet::meet_block(shear_of(rays, r), rays.single(r), ray.best_t, block,
                               [&](const BlockHit& hit) {
                                   if (!(hit.t < ray.best_t || hit.prim_id < rays.hits.prim_id[r]))
                                       return;
                                   ray.best_t = rays.hits.t[r] = hit.t;
                                   rays.hits.u[r] = hit.u;
                                   rays.hits.v[r] = hit.v;
                                   rays.hits.prim_id[r] = hit.prim_id;
                               });
        }
    }
    /// Those that hit a triangle stop looking. Which ones do of those that may is added up, not
    /// branched on: it is anybody's guess.
    PACKET_INLINE void occlude(Stream<Isa>& stream, RaySet active, const TriangleBlock& block,
                               int triangles) const {
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
                find_occluders(sheared, candidates, rays.single(r), rays.ray[r].best_t);
            hit |= RaySet{found.sure != 0} << r;
            open |= RaySet{found.possible != 0} << r;
        }
        for (RaySet left = open & ~hit; left != 0; left &= left - 1) {  // rare
            const int r = __builtin_ctzll(left);
            if (is_occluded(shear_of(rays, r), rays.single(r), rays.ray[r].best_t, block)) {
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
