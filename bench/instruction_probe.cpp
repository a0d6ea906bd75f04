// The steps of a walk as functions of their own, for count_instructions.sh to look at. ISA names
// the instruction set. No program holds this.
#include "kernels/leaf.h"

namespace packet {

template <Directions directions, int N, class Isa>
struct Probe {
    [[gnu::noinline]] static void visit_child(const PreparedRays<N, Isa>& ray, const WideNode& node,
                                              int child, const Float<N, Isa>& best_t,
                                              Float<N, Isa>& enter) {
        const BoxPlanes<directions, N, Isa> planes(node, child, ray.near_side);
        const Interval<N, Isa> box = planes.slabs(ray);
        enter = select(meets(ray, box, best_t), box.enter, Float<N, Isa>(__builtin_huge_valf()));
    }
    [[gnu::noinline]] static std::uint32_t rays_meet_triangle(const ShearRays<N, Isa>& ray,
                                                              const TriangleBlock& block,
                                                              int lane) {
        std::uint32_t bits = 0;
        const TriangleBlock* triangles = &block;
        for (int i = 0; i < LanesOf<N, Isa>::kRegisters; ++i) {  // as PacketLeaf does
            const auto sheared =
                shear<directions>(part(ray, ray.axis, i), SameTriangle{*triangles, lane});
            bits |= sheared.may_hit().bits() << i * kPartSize<N, Isa>;
            asm("" : "+r"(triangles), "+r"(bits));  // stands for the branch to decide_hits()
        }
        return bits;
    }
    [[gnu::noinline]] static void rays_hit_triangle(const PreparedRays<N, Isa>& ray,
                                                    const TriangleBlock& block, int lane,
                                                    std::uint32_t active, BestHits<N, Isa>& best) {
        const PacketLeaf<Query::kClosest, directions, N, Isa> leaf{ray, ray.shear.axis, 0, best};
        leaf.meet(block, 1u << lane, Mask<N, Isa>::from_bits(active));
    }
};

template <class Isa>
struct SingleProbe {
    [[gnu::noinline]] static std::uint32_t ray_meets_block(const SingleRay& ray,
                                                           const TriangleBlock& block) {
        const auto shear = shear_of<kBlockSize, Isa>(ray);
        return packet::shear<Directions::kShared>(shear, BlockTriangles{block}).may_hit().bits();
    }
};

template struct SingleProbe<isa::ISA>;
template struct Probe<Directions::kShared, 8, isa::ISA>;
template struct Probe<Directions::kMixed, 8, isa::ISA>;
template struct Probe<Directions::kShared, 16, isa::ISA>;
template struct Probe<Directions::kMixed, 16, isa::ISA>;

}  // namespace packet
