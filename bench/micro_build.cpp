// How fast structures are built, how large they are and what they are worth.
#include "course.h"
#include "micro.h"

#include "generate.h"

#include <packet/scene.h>

#include <benchmark/benchmark.h>
#include <fmt/core.h>

#include <cstddef>
#include <string_view>
#include <utility>

namespace packet::bench {
namespace {

// Far more than the caches hold, as in scenes whose building takes long enough to matter.
constexpr std::size_t kTriangleCount = 200'000;

void run(benchmark::State& state, Scene scene, const BuildOptions& options) {
    for (auto _ : state) scene.commit(options);
    const BuildStats& stats = scene.build_stats();
    const double triangles =
        static_cast<double>(state.iterations()) * static_cast<double>(scene.triangle_count());
    state.counters["triangles/s"] = benchmark::Counter(triangles, benchmark::Counter::kIsRate);
    state.counters["bytes/triangle"] =
        static_cast<double>(stats.bytes) / static_cast<double>(scene.triangle_count());
    state.counters["sah_cost"] = stats.sah_cost;
}

void add(std::string_view scene_kind, const Lazy<Scene>& scene, const AccelName& accel,
         int threads) {
    BuildOptions options;
    options.accel = accel.kind;
    options.threads = threads;
    const auto body = [scene, options](benchmark::State& state) {
        run(state, scene.get(), options);
    };
    const std::string name =
        fmt::format("build/{}/{}/{}", scene_kind, accel.name, threads == 0 ? "all" : "1");
    benchmark::RegisterBenchmark(name.c_str(), body)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime()
        ->MeasureProcessCPUTime();
}

}  // namespace

void add_build_benchmarks() {
    for (const std::string_view scene_kind : {"terrain", "city", "hairball", "soup"}) {
        const Lazy<Scene> scene(
            [=] { return make_scene(tools::generate(scene_kind, kTriangleCount)); });
        for (const AccelName& accel : accel_names()) {
            for (const int threads : {1, 0}) add(scene_kind, scene, accel, threads);
        }
    }
}

}  // namespace packet::bench
