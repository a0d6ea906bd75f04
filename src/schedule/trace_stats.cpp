// Names of modes, and sums of what was counted.
#include "core/names.h"

#include <packet/trace.h>

#include <algorithm>
#include <array>

namespace packet {

static constexpr std::array kModeNames = {
    ModeName{Mode::kAuto, "auto"},       ModeName{Mode::kSingle, "single"},
    ModeName{Mode::kPacket8, "packet8"}, ModeName{Mode::kPacket16, "packet16"},
    ModeName{Mode::kTile, "tile"},       ModeName{Mode::kStream, "stream"},
    ModeName{Mode::kTreelet, "treelet"},
};

static double ratio(std::uint64_t a, std::uint64_t b) {
    return b == 0 ? 0.0 : static_cast<double>(a) / static_cast<double>(b);
}

std::span<const ModeName> mode_names() noexcept { return kModeNames; }

std::string_view to_string(Mode mode) noexcept {
    for (const ModeName& entry : kModeNames) {
        if (entry.mode == mode) return entry.name;
    }
    return "?";
}

Mode parse_mode(std::string_view name) { return find_by_name(kModeNames, name, "mode").mode; }

TraceStats& TraceStats::operator+=(const TraceStats& other) noexcept {
    rays += other.rays;
    nodes += other.nodes;
    triangles += other.triangles;
    lanes_active += other.lanes_active;
    lanes_issued += other.lanes_issued;
    treelets += other.treelets;
    return *this;
}
TreeletTraceStats& TreeletTraceStats::operator+=(const TreeletTraceStats& other) noexcept {
    loads += other.loads;
    entries += other.entries;
    streams += other.streams;
    treelet_bytes += other.treelet_bytes;
    queue_bytes += other.queue_bytes;
    peak_queued = std::max(peak_queued, other.peak_queued);
    return *this;
}
double TreeletTraceStats::rays_per_load() const noexcept { return ratio(entries, loads); }
double TreeletTraceStats::stream_utilization() const noexcept {
    constexpr std::uint64_t kMostRays = 64;
    return ratio(entries, kMostRays * streams);
}
double TraceStats::nodes_per_ray() const noexcept { return ratio(nodes, rays); }
double TraceStats::triangles_per_ray() const noexcept { return ratio(triangles, rays); }
double TraceStats::lane_utilization() const noexcept { return ratio(lanes_active, lanes_issued); }

}  // namespace packet
