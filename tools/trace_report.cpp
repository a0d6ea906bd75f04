// What `packet trace` has found out, and how it says so.
#include "trace_report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace packet::tools {

double TraceReport::mrays_per_second() const noexcept {
    return seconds > 0.0 ? 1e-6 * static_cast<double>(rays) / seconds : 0.0;
}

std::string to_json(const TraceReport& report) {
    nlohmann::ordered_json json;
    json["scene"] = {{"triangles", report.triangles}, {"instances", report.instances}};
    json["accel"] = to_string(report.accel);
    json["device"] = report.device;
    json["mode"] = to_string(report.mode);
    json["isa"] = to_string(report.isa);
    json["threads"] = report.threads;
    json["query"] = report.query;
    json["rays"] = report.rays;
    json["hits"] = report.hits;
    json["build"] = {{"seconds", report.build.seconds},
                     {"bytes", report.build.bytes},
                     {"sah_cost", report.build.sah_cost}};
    json["trace"] = {{"seconds", report.seconds},
                     {"mrays_per_s", report.mrays_per_second()},
                     {"repeats", report.repeats}};
    json["stats"] = {
        {"nodes_per_ray", nullptr}, {"triangles_per_ray", nullptr}, {"lane_utilization", nullptr}};
    if (report.stats) {
        json["stats"] = {{"nodes_per_ray", report.stats->nodes_per_ray()},
                         {"triangles_per_ray", report.stats->triangles_per_ray()},
                         {"lane_utilization", report.stats->lane_utilization()}};
        const TreeletTraceStats& treelets = report.stats->treelets;
        if (treelets.entries != 0) {
            const auto rays = static_cast<double>(report.stats->rays);
            json["stats"]["treelets"] = {
                {"count", report.build.treelets.count},
                {"bytes", report.build.treelets.bytes},
                {"cut_edges", report.build.treelets.cut_edges},
                {"expected_entries", report.build.treelets.expected_entries},
                {"entries_per_ray", static_cast<double>(treelets.entries) / rays},
                {"loads_per_ray", static_cast<double>(treelets.loads) / rays},
                {"rays_per_load", treelets.rays_per_load()},
                {"treelet_bytes_per_ray", static_cast<double>(treelets.treelet_bytes) / rays},
                {"queue_bytes_per_ray", static_cast<double>(treelets.queue_bytes) / rays},
                {"peak_queued", treelets.peak_queued},
                {"stream_utilization", treelets.stream_utilization()}};
        }
    }
    return json.dump() + "\n";
}

static std::string treelets_to_text(const TraceReport& report) {
    const TreeletStats& cut = report.build.treelets;
    const TreeletTraceStats& done = report.stats->treelets;
    const auto rays = static_cast<double>(report.stats->rays);
    std::string text = fmt::format(
        "       {} treelets, {:.0f} KB on average; {:.1f} expected for a ray that meets the "
        "scene\n",
        cut.count, 1e-3 * static_cast<double>(cut.bytes) / static_cast<double>(cut.count),
        cut.expected_entries);
    text +=
        fmt::format("       enters {:.1f} treelets, {:.0f} rays a load, {:.0f}% of streams full\n",
                    static_cast<double>(done.entries) / rays, done.rays_per_load(),
                    100.0 * done.stream_utilization());
    text += fmt::format(
        "       moves {:.0f} bytes of treelets and {:.0f} of queues, where {} rays wait at most\n",
        static_cast<double>(done.treelet_bytes) / rays,
        static_cast<double>(done.queue_bytes) / rays, done.peak_queued);
    return text;
}

std::string to_text(const TraceReport& report) {
    const auto percent = [](std::size_t part, std::size_t whole) {
        return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
    };
    std::string text =
        fmt::format("scene  {} triangles in {} instances\n", report.triangles, report.instances);
    text += fmt::format("build  {}: {:.3f} s, {:.1f} MB, SAH cost {:.1f}\n",
                        to_string(report.accel), report.build.seconds,
                        static_cast<double>(report.build.bytes) * 1e-6, report.build.sah_cost);
    text += fmt::format("rays   {} {}-hit, {:.1f}% hit\n", report.rays, report.query,
                        percent(report.hits, report.rays));
    text += fmt::format("trace  {}, {}, {} threads: {:.6f} s, {:.2f} Mrays/s (median of {})\n",
                        to_string(report.mode), to_string(report.isa), report.threads,
                        report.seconds, report.mrays_per_second(), report.repeats);
    if (report.stats) {
        text +=
            fmt::format("a ray  meets {:.1f} nodes and {:.1f} triangles, {:.0f}% of lanes used\n",
                        report.stats->nodes_per_ray(), report.stats->triangles_per_ray(),
                        100.0 * report.stats->lane_utilization());
        if (report.stats->treelets.entries != 0) text += treelets_to_text(report);
    }
    return text;
}

}  // namespace packet::tools
