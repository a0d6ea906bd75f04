// What a contest came to: as a table for people, as JSON for programs.
#pragma once

#include "contest.h"

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace packet::bench {

/// The scores on one set of rays.
struct Row {
    std::string_view rays;
    Query query;
    std::size_t ray_count;
    Contest contest;
    std::vector<Score> scores;

    /// All contenders saw the same, so that their speeds may be compared.
    [[nodiscard]] bool acceptable() const;
    /// The fastest of a side. It has one.
    [[nodiscard]] const Score& best(Side side) const;
    /// Our default mode.
    [[nodiscard]] const Score& auto_score() const;
    [[nodiscard]] double mrays_per_s(const Score& score) const;
    /// Our default mode's speed over Embree's fastest mode's: above 1, ours is faster.
    [[nodiscard]] double ratio() const;
};

struct Build {
    std::string_view name;
    double seconds;
    std::size_t bytes;  ///< of what is traced
};

struct Report {
    std::string scene;
    std::size_t triangle_count;
    std::vector<Build> builds;
    std::vector<Row> rows;
};

// The table, line by line as the contests end. Rows that are not acceptable show no ratio.
void print_head(const Report& report, std::span<const Contender> contenders);
void print_row(const Row& row);

[[nodiscard]] nlohmann::json to_json(const Report& report);

}  // namespace packet::bench
