// packet_micro: every mode by every instruction set on small generated scenes, with the work that a
// ray takes. It answers why something is slow; packet_bench answers whether it is. And builders.
#include "micro_build.h"
#include "micro_overlap.h"

#include <packet/isa.h>
#include <packet/scene.h>
#include <packet/trace.h>

#include <benchmark/benchmark.h>
#include <fmt/core.h>

#include <camera.h>
#include <generate.h>
#include <ray_kinds.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace packet::bench {
namespace {

// Small enough to stay in the cache, so that it is the kernels that are measured.
constexpr std::size_t kTriangleCount = 20'000;
constexpr tools::ImageSize kImageSize{256, 256};

/// A generated scene and rays to trace in it.
struct Course {
    Scene scene;
    std::vector<Ray> rays;
    int width;
};

Course make_course(std::string_view scene_kind, tools::RayKind ray_kind) {
    Scene scene = make_scene(tools::generate(scene_kind, kTriangleCount));
    scene.commit();
    tools::CameraOptions camera;
    camera.size = kImageSize;
    std::vector<Ray> rays = make_rays(ray_kind, scene, {camera, scene.bounds()}, 1);
    const int width = ray_kind == tools::RayKind::kPrimary ? kImageSize.width : 0;
    return {std::move(scene), std::move(rays), width};
}

/// Counted in a run of its own, for counting costs time.
void report_work(benchmark::State& state, const Course& course, TraceOptions options,
                 std::vector<Hit>& hits) {
    TraceStats stats;
    options.stats = &stats;
    trace_closest(course.scene, course.rays, hits, options);
    state.counters["nodes/ray"] = stats.nodes_per_ray();
    state.counters["triangles/ray"] = stats.triangles_per_ray();
    state.counters["lanes_used"] = stats.lane_utilization();
}

void run(benchmark::State& state, const Course& course, Mode mode, IsaId isa) {
    if (!cpu_supports(isa)) return state.SkipWithError("this CPU lacks the instruction set");
    TraceOptions options;
    options.mode = mode;
    options.threads = 1;
    options.width = course.width;
    options.isa = isa;
    std::vector<Hit> hits(course.rays.size());
    for (auto _ : state) {
        trace_closest(course.scene, course.rays, hits, options);
        benchmark::DoNotOptimize(hits.data());
    }
    const double rays =
        static_cast<double>(state.iterations()) * static_cast<double>(course.rays.size());
    state.counters["rays/s"] = benchmark::Counter(rays, benchmark::Counter::kIsRate);
    report_work(state, course, options, hits);
}

void add_benchmarks(std::string_view scene_kind, const tools::Named<tools::RayKind>& ray_kind) {
    const auto course = std::make_shared<Course>(make_course(scene_kind, ray_kind.value));
    for (const ModeName& mode : mode_names()) {
        for (const IsaId isa : built_isas()) {
            const std::string name =
                fmt::format("{}/{}/{}/{}", scene_kind, ray_kind.name, mode.name, to_string(isa));
            const auto body = [course, mode, isa](benchmark::State& state) {
                run(state, *course, mode.mode, isa);
            };
            benchmark::RegisterBenchmark(name.c_str(), body)->Unit(benchmark::kMillisecond);
        }
    }
}

}  // namespace
}  // namespace packet::bench

int main(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    for (const std::string_view scene_kind : {"sphere", "terrain", "soup"}) {
        for (const auto& ray_kind : packet::tools::kRayKinds) {
            packet::bench::add_benchmarks(scene_kind, ray_kind);
        }
    }
    packet::bench::add_build_benchmarks();
    packet::bench::add_overlap_benchmarks();
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
}
