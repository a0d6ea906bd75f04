// What `packet trace` has found out, and how it says so.
#pragma once

#include <packet/accel.h>
#include <packet/isa.h>
#include <packet/trace.h>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace packet::tools {

struct TraceReport {
    std::size_t triangles = 0;
    std::size_t instances = 0;
    AccelKind accel = AccelKind::kBvh;
    std::string_view device = "cpu";
    Mode mode = Mode::kAuto;  ///< as asked for
    IsaId isa = IsaId::kScalar;
    int threads = 1;
    std::string_view query;
    std::size_t rays = 0;
    std::size_t hits = 0;
    BuildStats build;
    double seconds = 0.0;  ///< median over the repeats
    int repeats = 1;
    std::optional<TraceStats> stats;

    [[nodiscard]] double mrays_per_second() const noexcept;
};

/// One JSON object and a line's end. Values that were not measured or are not finite are null.
[[nodiscard]] std::string to_json(const TraceReport& report);
[[nodiscard]] std::string to_text(const TraceReport& report);

}  // namespace packet::tools
