// The steps of a walk as functions of their own, for count_instructions.sh to look at. ISA names
// the instruction set. No program holds this.
#include "kernels/leaf.h"
#include "kernels/packet_walk.h"

namespace packet {

template <Directions directions, int N, class Isa>
struct Probe {
    [[gnu::noinline]] static void visit_node(const PreparedRays<N, Isa>& ray, const Node& node,
                                             const Float<N, Isa>& best_t, Float<N, Isa>& enter) {
        enter = entry<directions>(ray, node, best_t);
    }
    [[gnu::noinline]] static std::uint32_t rays_meet_triangle(const ShearRays<N, Isa>& ray,
                                                              const TriangleBlock& block,
                                                              int lane) {
        return may_hit<directions>(ray, SameTriangle{block, lane}).bits();
    }
    [[gnu::noinline]] static void rays_hit_triangle(const PreparedRays<N, Isa>& ray,
                                                    const TriangleBlock& block, int lane,
                                                    const Float<N, Isa>& best_t,
                                                    std::uint32_t candidates,
                                                    TriangleHits<N, Isa>& out) {
        out = decide_hits<directions>(ray, best_t, Mask<N, Isa>::from_bits(candidates),
                                      SameTriangle{block, lane});
    }
};

template <class Isa>
struct SingleProbe {
    [[gnu::noinline]] static std::uint32_t ray_meets_block(const SingleRay& ray,
                                                           const TriangleBlock& block) {
        ShearRays<kBlockSize, Isa> shear;
        ray.broadcast(shear);
        return may_hit<Directions::kShared>(shear, BlockTriangles{block}).bits();
    }
};

template struct SingleProbe<isa::ISA>;
template struct Probe<Directions::kShared, 8, isa::ISA>;
template struct Probe<Directions::kMixed, 8, isa::ISA>;
template struct Probe<Directions::kShared, 16, isa::ISA>;
template struct Probe<Directions::kMixed, 16, isa::ISA>;

}  // namespace packet
