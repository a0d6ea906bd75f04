// Wall-clock times, and the middle of several.
#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

namespace packet::tools {

/// How long a call of the function takes.
template <class Function>
[[nodiscard]] double seconds_of(Function&& function) {
    const auto start = std::chrono::steady_clock::now();
    function();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// One that slow runs, which something interrupted, do not move. There is at least one value.
[[nodiscard]] inline double median(std::vector<double> values) {
    std::ranges::sort(values);
    const std::size_t half = values.size() / 2;
    return values.size() % 2 != 0 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

}  // namespace packet::tools
