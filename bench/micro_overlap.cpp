// Triangle-box overlap as a grid's builder asks for it: triangles a few cells large, each against
// runs of 32 cells of which its own box meets most.
#include "micro.h"

#include "build/overlap.h"
#include "dispatch/dispatch.h"
#include "random.h"

#include <packet/isa.h>

#include <benchmark/benchmark.h>
#include <fmt/core.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace packet::bench {
namespace {

constexpr int kBoxes = 32;
constexpr std::size_t kRunCount = 1024;  // a megabyte, which stays in the cache

/// A triangle and four rows of eight cells.
struct Run {
    float v[3][3], lower[3][kBoxes], upper[3][kBoxes];

    [[nodiscard]] glm::vec3 corner(int k) const { return {v[k][0], v[k][1], v[k][2]}; }
    [[nodiscard]] Bounds3f box(int i) const {
        return {{lower[0][i], lower[1][i], lower[2][i]}, {upper[0][i], upper[1][i], upper[2][i]}};
    }
};

/// A triangle about eight cells wide, in any direction, and eight cells from its box's lower x on
/// in each of four rows, from one that the box meets on. Cells have side 1.
Run make_run(tools::Random& random) {
    Run out;
    const glm::vec3 center = 100.0f * random.point();
    Bounds3f box;
    for (auto& corner : out.v) {
        const glm::vec3 p = center + 5.0f * random.direction();
        box.extend(p);
        for (int a = 0; a < 3; ++a) corner[a] = p[a];
    }
    const glm::vec3 first =
        glm::floor(glm::vec3{box.lower.x, random.uniform(box.lower.y, box.upper.y - 3.0f),
                             random.uniform(box.lower.z, box.upper.z)});
    for (int a = 0; a < 3; ++a) {
        for (int i = 0; i < kBoxes; ++i) {
            const int place[3] = {i % 8, i / 8, 0};
            out.lower[a][i] = first[a] + static_cast<float>(place[a]);
            out.upper[a][i] = out.lower[a][i] + 1.0f;
        }
    }
    return out;
}

using Runs = std::vector<Run>;

std::shared_ptr<const Runs> make_runs() {
    tools::Random random(1);
    auto out = std::make_shared<Runs>(kRunCount);
    for (Run& run : *out) run = make_run(random);
    return out;
}

template <class Ask>
void measure(benchmark::State& state, const Runs& runs, Ask ask) {
    std::int64_t overlaps = 0;
    for (auto _ : state) {
        overlaps = 0;
        for (const Run& run : runs) overlaps += ask(run);
        benchmark::DoNotOptimize(overlaps);
    }
    const double boxes = static_cast<double>(runs.size()) * kBoxes;
    state.counters["boxes/s"] = benchmark::Counter(boxes * static_cast<double>(state.iterations()),
                                                   benchmark::Counter::kIsRate);
    state.counters["overlapping"] = static_cast<double>(overlaps) / boxes;
}

void add_wide(const char* test, KernelTable::Overlap KernelTable::*kernel,
              const std::shared_ptr<const Runs>& runs) {
    for (const IsaId isa : built_isas()) {
        const auto body = [runs, kernel, isa](benchmark::State& state) {
            if (!cpu_supports(isa)) {
                return state.SkipWithError("this CPU lacks the instruction set");
            }
            const KernelTable::Overlap overlap = select_kernels(isa).*kernel;
            measure(state, *runs, [overlap](const Run& run) {
                return __builtin_popcount(overlap(run.v, run.lower, run.upper, kBoxes));
            });
        };
        const std::string name = fmt::format("overlap/{}/{}/{}", test, kBoxes, to_string(isa));
        benchmark::RegisterBenchmark(name.c_str(), body);
    }
}

template <class Overlaps>
void add_single(const char* test, const std::shared_ptr<const Runs>& runs, Overlaps overlaps) {
    const auto body = [runs, overlaps](benchmark::State& state) {
        measure(state, *runs, [&](const Run& run) {
            const glm::vec3 v[3] = {run.corner(0), run.corner(1), run.corner(2)};
            int found = 0;
            for (int i = 0; i < kBoxes; ++i) found += overlaps(v, run.box(i)) ? 1 : 0;
            return found;
        });
    };
    benchmark::RegisterBenchmark(fmt::format("overlap/{}/1/scalar", test).c_str(), body);
}

}  // namespace

void add_overlap_benchmarks() {
    const std::shared_ptr<const Runs> runs = make_runs();
    add_single("axes", runs, overlaps_by_axes);
    add_wide("axes", &KernelTable::overlap_axes, runs);
    add_single("clip", runs, overlaps_by_clipping);
    add_wide("clip", &KernelTable::overlap_clip, runs);
}

}  // namespace packet::bench
