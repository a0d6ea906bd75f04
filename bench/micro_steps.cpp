// The box and triangle tests that walks are made of, by how many rays and items they take at once
// and by instruction set.
#include "micro.h"
#include "step_probe.h"

#include "build/triangle_block.h"

#include <packet/isa.h>

#include <benchmark/benchmark.h>
#include <fmt/core.h>

#include <generate.h>
#include <random.h>

#include <vector>

namespace packet::bench {
namespace {

// All of it stays in the first level's cache.
constexpr std::size_t kBoxCount = 256;
constexpr std::size_t kTriangleCount = 256;
constexpr std::size_t kRayCount = 64;

struct StepData {
    std::vector<Ray> rays;
    std::vector<WideNode> wide_nodes;
    std::vector<TriangleBlock> blocks;

    StepData() : wide_nodes(kBoxCount / kWideSize) {
        tools::Random random(1);
        for (std::size_t i = 0; i < kRayCount; ++i) rays.push_back(make_ray(random));
        for (std::size_t i = 0; i < kBoxCount; ++i) set_box(i, random);
        const TriangleMesh mesh = tools::make_soup(kTriangleCount, 1);
        blocks.assign(kTriangleCount / kBlockSize, make_empty_block());
        for (std::uint32_t i = 0; i < kTriangleCount; ++i) {
            put_triangle(blocks[i / kBlockSize], i % kBlockSize, mesh.view(), i);
        }
    }

    [[nodiscard]] StepInput input() const {
        StepInput in{};
        in.tree.wide_nodes = wide_nodes.data();
        in.tree.blocks = blocks.data();
        for (float& upper : in.tree.upper) upper = 1.0f;
        in.wide_node_count = wide_nodes.size();
        in.block_count = blocks.size();
        in.rays = rays.data();
        in.ray_count = rays.size();
        return in;
    }

private:
    /// From below through the unit cube, mostly upward: all share octant and longest axis.
    static Ray make_ray(tools::Random& random) {
        const glm::vec3 from = random.point(), to = random.point();
        Ray ray;
        ray.org = {0.5f * from.x, 0.5f * from.y, -1.0f};
        ray.dir = {0.1f + 0.4f * to.x, 0.1f + 0.4f * to.y, 1.0f};
        return ray;
    }
    void set_box(std::size_t i, tools::Random& random) {
        const glm::vec3 lower = 0.6f * random.point(), size = 0.4f * random.point();
        WideNode& wide = wide_nodes[i / kWideSize];
        for (int a = 0; a < 3; ++a) {
            wide.plane[0][a][i % kWideSize] = lower[a];
            wide.plane[1][a][i % kWideSize] = lower[a] + size[a];
        }
    }
};

StepProbes probes_of(IsaId isa) {
    switch (isa) {
        case IsaId::kSse42: return step_probes_sse42();
        case IsaId::kAvx2: return step_probes_avx2();
        case IsaId::kAvx512: return step_probes_avx512();
        case IsaId::kScalar: break;
    }
    return step_probes_scalar();
}

void run(benchmark::State& state, const StepData& data, StepProbe probe, IsaId isa) {
    if (!cpu_supports(isa)) return state.SkipWithError("this CPU lacks the instruction set");
    const StepInput input = data.input();
    std::uint64_t met = 0;
    for (auto _ : state) {
        met = probe(input);
        benchmark::DoNotOptimize(met);
    }
    static_assert(kBoxCount == kTriangleCount);
    constexpr double kPairs = static_cast<double>(kRayCount) * kBoxCount;
    state.counters["tests/s"] = benchmark::Counter(kPairs * static_cast<double>(state.iterations()),
                                                   benchmark::Counter::kIsRate);
    state.counters["met"] = static_cast<double>(met) / kPairs;
}

}  // namespace

void add_step_benchmarks() {
    static const StepData data;
    for (int step = 0; step < StepProbes::kCount; ++step) {
        for (const IsaId isa : built_isas()) {
            const StepName its = probes_of(isa).steps[step];
            const auto body = [isa, probe = its.probe](benchmark::State& state) {
                run(state, data, probe, isa);
            };
            benchmark::RegisterBenchmark(fmt::format("{}/{}", its.name, to_string(isa)).c_str(),
                                         body);
        }
    }
}

}  // namespace packet::bench
