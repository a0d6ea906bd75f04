// The part of packet_micro about triangle-box overlap.
#pragma once

namespace packet::bench {

/// Registers overlap/TEST/WIDTH/ISA for both tests.
void add_overlap_benchmarks();

}  // namespace packet::bench
