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
    }
    return json.dump() + "\n";
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
    }
    return text;
}

}  // namespace packet::tools
