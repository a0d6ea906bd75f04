// The steps of walks, box and triangle tests, each in a loop of its own for one instruction set.
// Compiled per instruction set, as the kernels are.
#pragma once

#include "kernels/leaf.h"
#include "kernels/single_walk.h"

#include <cstddef>
#include <cstdint>

namespace packet::bench {

/// Each of the rays meets each of the boxes or triangles.
struct StepInput {
    TreeView tree;  ///< has wide nodes, blocks, and the box of all
    std::size_t wide_node_count, block_count;
    const Ray* rays;
    std::size_t ray_count;  ///< a multiple of 16; each 16 share their directions' octant and axis
};

/// Returns how many of all pairs of a ray and an item meet.
using StepProbe = std::uint64_t (*)(const StepInput&);

struct StepName {
    const char* name;  ///< test / rays x items at once
    StepProbe probe;
};
/// In the order of their names, the same for all instruction sets.
struct StepProbes {
    static constexpr int kCount = 11;
    StepName steps[kCount];
};

StepProbes step_probes_scalar();
StepProbes step_probes_sse42();
StepProbes step_probes_avx2();
StepProbes step_probes_avx512();

template <int N, class Isa>
PACKET_INLINE RayLanes<N, Isa> load_rays(const Ray* rays) {
    float lanes[8][N];
    for (int i = 0; i < N; ++i) {
        const Ray& ray = rays[i];
        lanes[0][i] = ray.org.x, lanes[1][i] = ray.org.y, lanes[2][i] = ray.org.z;
        lanes[3][i] = ray.dir.x, lanes[4][i] = ray.dir.y, lanes[5][i] = ray.dir.z;
        lanes[6][i] = ray.tnear, lanes[7][i] = ray.tfar;
    }
    using F = Float<N, Isa>;
    return {{F::load(lanes[0]), F::load(lanes[1]), F::load(lanes[2])},
            {F::load(lanes[3]), F::load(lanes[4]), F::load(lanes[5])},
            F::load(lanes[6]),
            F::load(lanes[7])};
}

/// Calls step(prepared rays, best_t) for every N rays.
template <int N, class Isa, class Step>
PACKET_INLINE void for_each_packet(const StepInput& in, Step&& step) {
    for (std::size_t i = 0; i < in.ray_count; i += N) {
        const RayLanes<N, Isa> lanes = load_rays<N, Isa>(in.rays + i);
        PreparedRays<N, Isa> rays;
        prepare(rays, in.tree, lanes, (1u << N) - 1);
        step(rays, Float<N, Isa>(kLargestFloat));
    }
}

template <Directions directions, int N, class Isa>
std::uint64_t packets_meet_boxes(const StepInput& in) {
    std::uint64_t met = 0;
    for_each_packet<N, Isa>(in, [&](const PreparedRays<N, Isa>& rays, Float<N, Isa> best_t) {
        for (std::size_t i = 0; i < in.wide_node_count * kWideSize; ++i) {
            const BoxPlanes<directions, N, Isa> planes(
                in.tree.wide_nodes[i / kWideSize], static_cast<int>(i % kWideSize), rays.near_side);
            met += static_cast<std::uint64_t>(count(meets(rays, planes.slabs(rays), best_t)));
        }
    });
    return met;
}

template <Directions directions, int N, class Isa>
std::uint64_t packets_meet_triangles(const StepInput& in) {
    std::uint64_t met = 0;
    for_each_packet<N, Isa>(in, [&](const PreparedRays<N, Isa>& rays, Float<N, Isa> best_t) {
        for (std::size_t item = 0; item < in.block_count * kBlockSize; ++item) {
            const SameTriangle triangle{in.tree.blocks[item / kBlockSize],
                                        static_cast<int>(item % kBlockSize)};
            const Mask<N, Isa> all = best_t > Float<N, Isa>(kNever);
            for (int i = 0; i < LanesOf<N, Isa>::kRegisters; ++i) {  // as PacketLeaf does
                const auto sheared =
                    shear<directions>(part(rays.shear, rays.shear.axis, i), triangle);
                const auto candidates = part(all, i) & sheared.may_hit();
                if (none(candidates)) continue;
                met += static_cast<std::uint64_t>(count(
                    decide_hits(sheared, part(rays.hit, i), part(best_t, i), candidates, triangle)
                        .hit));
            }
        }
    });
    return met;
}

/// Calls step(ray) for every ray.
template <class Isa, class Step>
PACKET_INLINE void for_each_single(const StepInput& in, Step&& step) {
    for (std::size_t i = 0; i < in.ray_count; ++i) {
        SingleRay ray;
        prepare(ray, in.tree, RayAxes<Isa>(in.rays[i]));
        step(ray);
    }
}

template <class Isa>
std::uint64_t ray_meets_wide_boxes(const StepInput& in) {
    using F = Float<kWideSize, Isa>;
    std::uint64_t met = 0;
    for_each_single<Isa>(in, [&](const SingleRay& ray) {
        const auto wide_ray = wide<Isa>(ray);
        for (std::size_t i = 0; i < in.wide_node_count; ++i) {
            F enter;
            const std::uint32_t bits =
                wide_ray.meets(in.tree.wide_nodes[i], F(kLargestFloat), enter);
            met += static_cast<std::uint64_t>(__builtin_popcount(bits));
        }
    });
    return met;
}

template <class Isa>
std::uint64_t ray_meets_blocks(const StepInput& in) {
    constexpr Directions kShared = Directions::kShared;  // one ray in all lanes
    std::uint64_t met = 0;
    for_each_single<Isa>(in, [&](const SingleRay& ray) {
        const auto shear = shear_of<kBlockSize, Isa>(ray);
        for (std::size_t i = 0; i < in.block_count; ++i) {
            const BlockTriangles triangles{in.tree.blocks[i]};
            const auto sheared = packet::shear<kShared>(shear, triangles);
            const Mask<kBlockSize, Isa> candidates = sheared.may_hit();
            if (none(candidates)) continue;
            const SingleHitRay<kBlockSize, Isa> hit_ray(ray);
            const Float<kBlockSize, Isa> best_t(kLargestFloat);
            met += static_cast<std::uint64_t>(
                count(decide_hits(sheared, hit_ray, best_t, candidates, triangles).hit));
        }
    });
    return met;
}

template <class Isa>
StepProbes make_step_probes() {
    constexpr Directions kShared = Directions::kShared, kMixed = Directions::kMixed;
    return {{{"box/1x1", packets_meet_boxes<kShared, 1, Isa>},
             {"box/1x8", ray_meets_wide_boxes<Isa>},
             {"box/8x1", packets_meet_boxes<kShared, 8, Isa>},
             {"box/8x1mixed", packets_meet_boxes<kMixed, 8, Isa>},
             {"box/16x1", packets_meet_boxes<kShared, 16, Isa>},
             {"box/16x1mixed", packets_meet_boxes<kMixed, 16, Isa>},
             {"triangle/1x1", packets_meet_triangles<kShared, 1, Isa>},
             {"triangle/1x8", ray_meets_blocks<Isa>},
             {"triangle/8x1", packets_meet_triangles<kShared, 8, Isa>},
             {"triangle/16x1", packets_meet_triangles<kShared, 16, Isa>},
             {"triangle/16x1mixed", packets_meet_triangles<kMixed, 16, Isa>}}};
}

}  // namespace packet::bench
