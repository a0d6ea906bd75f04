// Tables in Markdown, line by line as results come.
#pragma once

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <string>
#include <vector>

namespace packet::bench {

inline void print_cells(const std::vector<std::string>& cells) {
    fmt::print("| {} |\n", fmt::join(cells, " | "));
    std::fflush(stdout);
}

inline void print_table_head(const std::vector<std::string>& titles) {
    print_cells(titles);
    print_cells(std::vector<std::string>(titles.size(), "---"));
}

/// With about three digits that say something.
[[nodiscard]] inline std::string three_digits(double value) {
    const int decimals = value < 0.0995 ? 3 : value < 9.95 ? 2 : value < 99.5 ? 1 : 0;
    return fmt::format("{:.{}f}", value, decimals);
}

}  // namespace packet::bench
