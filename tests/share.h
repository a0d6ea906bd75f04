// How much of their work tests do: all of it, unless PACKET_TEST_SHARE names a share. The
// sanitizers' presets do, where everything is ten times slower. Every kind of case stays: of rays,
// triangles and repetitions there are fewer, of structures, modes and instruction sets there are
// not.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>

namespace packet::test {

/// The share of the work to do, over 0 and up to 1.
[[nodiscard]] inline double test_share() {
    static const double share = [] {
        const char* text = std::getenv("PACKET_TEST_SHARE");
        const double value = text != nullptr ? std::strtod(text, nullptr) : 1.0;
        return value > 0.0 && value < 1.0 ? value : 1.0;
    }();
    return share;
}

/// The share of `all`, but no fewer than `least`: as many as it takes to come by what is tested.
[[nodiscard]] inline std::size_t share_of(std::size_t all, std::size_t least = 1) {
    const auto share = static_cast<std::size_t>(test_share() * static_cast<double>(all));
    return std::max(share, std::min(least, all));
}

}  // namespace packet::test
