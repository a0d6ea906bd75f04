// packet_micro: the parts of tracing and building, each for itself, with the work that a ray takes.
// It answers why something is slow; packet_bench answers whether it is.
#include "micro.h"

#include <benchmark/benchmark.h>

int main(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    packet::bench::add_step_benchmarks();
    packet::bench::add_overlap_benchmarks();
    packet::bench::add_trace_benchmarks();
    packet::bench::add_walk_benchmarks();
    packet::bench::add_sweep_benchmarks();
    packet::bench::add_build_benchmarks();
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
}
