#include "course.h"

#include <benchmark/benchmark.h>

namespace packet::bench {
namespace {

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

void run(benchmark::State& state, const Course& course, TraceOptions options) {
    options.threads = 1;
    options.width = course.width;
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

}  // namespace

void add_course(const std::string& name, const Lazy<Course>& course, Mode mode,
                std::optional<IsaId> isa) {
    TraceOptions options;
    options.mode = mode;
    options.isa = isa;
    const auto body = [course, options](benchmark::State& state) {
        if (options.isa && !cpu_supports(*options.isa)) {
            return state.SkipWithError("this CPU lacks the instruction set");
        }
        run(state, course.get(), options);
    };
    benchmark::RegisterBenchmark(name.c_str(), body)->Unit(benchmark::kMillisecond);
}

}  // namespace packet::bench
