// The groups of benchmarks that packet_micro registers. Scenes are made when a benchmark first
// needs them, so that a filter costs nothing for those that it leaves out.
#pragma once

namespace packet::bench {

/// TEST/RAYSxITEMS/ISA: box and triangle tests in a loop.
void add_step_benchmarks();
/// overlap/TEST/BOXES/ISA: the builders' overlap test of triangles and boxes.
void add_overlap_benchmarks();
/// trace/SCENE/RAYS/MODE/ISA: small scenes that stay in the cache.
void add_trace_benchmarks();
/// walk/STRUCTURE/RAYS/MODE: every walk on every structure.
void add_walk_benchmarks();
/// angle/DEGREES/MODE, origin/PERCENT/MODE, order/ORDER/MODE, bounce/DEPTH/MODE: rays from coherent
/// to not.
void add_sweep_benchmarks();
/// build/SCENE/STRUCTURE/THREADS.
void add_build_benchmarks();

}  // namespace packet::bench
