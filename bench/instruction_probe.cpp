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
    [[gnu::noinline]] static void rays_meet_triangle(const PreparedRays<N, Isa>& ray,
                                                     const TriangleBlock& block, int lane,
                                                     const Float<N, Isa>& best_t,
                                                     TriangleHits<N, Isa>& out) {
        out = test_triangles<directions>(ray, best_t, [&](int corner, int axis) {
            return Float<N, Isa>(block.v[corner][axis][lane]);
        });
    }
    [[gnu::noinline]] static void ray_meets_block(const PreparedRays<N, Isa>& ray,
                                                  const TriangleBlock& block,
                                                  const Float<N, Isa>& best_t,
                                                  TriangleHits<N, Isa>& out) {
        out = test_triangles<directions>(ray, best_t, [&](int corner, int axis) {
            return Float<N, Isa>::load(block.v[corner][axis]);
        });
    }
};

template struct Probe<Directions::kShared, 8, isa::ISA>;
template struct Probe<Directions::kMixed, 8, isa::ISA>;
template struct Probe<Directions::kShared, 16, isa::ISA>;
template struct Probe<Directions::kMixed, 16, isa::ISA>;

}  // namespace packet
