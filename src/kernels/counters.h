// Counting work. Walks take a policy: one counts, the other is empty and leaves no instruction.
#pragma once

#include "core/macros.h"

#include <packet/trace.h>

#include <cstdint>

namespace packet {

struct NoCounters {
    PACKET_INLINE explicit NoCounters(TraceStats*) {}
    template <class M>
    PACKET_INLINE void boxes(const M&, int, int) {}
    PACKET_INLINE void triangles(int) {}
};

class Counters {
public:
    PACKET_INLINE explicit Counters(TraceStats* stats) : stats_(*stats) {}
    /// `active` lanes of `lane_count` met `node_count` boxes.
    template <class M>
    PACKET_INLINE void boxes(const M& active, int lane_count, int node_count) {
        const std::uint64_t lanes = static_cast<std::uint64_t>(count(active));
        const std::uint64_t nodes = static_cast<std::uint64_t>(node_count);
        stats_.nodes += lanes * nodes;
        stats_.lanes_active += lanes * nodes;
        stats_.lanes_issued += nodes * static_cast<std::uint64_t>(lane_count);
    }
    PACKET_INLINE void triangles(int tests) {
        stats_.triangles += static_cast<std::uint64_t>(tests);
    }

private:
    TraceStats& stats_;
};

}  // namespace packet
