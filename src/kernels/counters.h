// Counting work. Walks take a policy: one counts, the other is empty and leaves no instruction.
#pragma once

#include "core/macros.h"

#include <packet/trace.h>

#include <cstdint>

namespace packet {

struct NoCounters {
    static constexpr bool kCounts = false;
    PACKET_INLINE explicit NoCounters(TraceStats*) {}
    PACKET_INLINE void visit(int, int) {}
    PACKET_INLINE void triangles(int) {}
    PACKET_INLINE void treelet_stream(int) {}
};

class Counters {
public:
    static constexpr bool kCounts = true;
    PACKET_INLINE explicit Counters(TraceStats* stats) : stats_(*stats) {}
    /// `active` of `lanes` lanes visit a node.
    PACKET_INLINE void visit(int active, int lanes) {
        stats_.nodes += static_cast<std::uint64_t>(active);
        stats_.lanes_active += static_cast<std::uint64_t>(active);
        stats_.lanes_issued += static_cast<std::uint64_t>(lanes);
    }
    PACKET_INLINE void triangles(int tests) {
        stats_.triangles += static_cast<std::uint64_t>(tests);
    }
    /// A stream of `rays` enters a treelet.
    PACKET_INLINE void treelet_stream(int rays) {
        stats_.treelets.entries += static_cast<std::uint64_t>(rays);
        ++stats_.treelets.streams;
    }

private:
    TraceStats& stats_;
};

}  // namespace packet
