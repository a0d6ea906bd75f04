// The part of packet_micro about building.
#pragma once

namespace packet::bench {

/// Registers build/SCENE/STRUCTURE/THREADS for all structures, on one thread and on all.
void add_build_benchmarks();

}  // namespace packet::bench
