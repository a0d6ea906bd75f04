// Triangles and boxes in integer coordinates that floats hold exactly: random ones, and those that
// touch, almost touch, are thin, degenerate, or far from the origin.
#pragma once

#include "overlap_reference.h"
#include "random.h"

#include <algorithm>
#include <cstdint>

namespace packet::test {

inline constexpr int kBoxes = 8;

/// One triangle, eight boxes, all coordinates multiples of `unit`, a power of two, and less than
/// 2^41 of it.
struct OverlapCase {
    std::int64_t v[3][3], lower[3][kBoxes], upper[3][kBoxes];
    int unit_exponent;
    bool is_small;  ///< coordinates are less than 2^18

    template <class Int>
    [[nodiscard]] IntegerPair<Int> pair(int box) const {
        IntegerPair<Int> out;
        for (int a = 0; a < 3; ++a) {
            for (int k = 0; k < 3; ++k) out.v[k][a] = v[k][a];
            out.lower[a] = lower[a][box], out.upper[a] = upper[a][box];
        }
        return out;
    }
    [[nodiscard]] bool reference(int box) const {
        return is_small ? overlap_in_integers(pair<std::int64_t>(box))
                        : overlap_in_integers(pair<Int128>(box));
    }
};

class OverlapCases {
public:
    explicit OverlapCases(std::uint64_t seed) : random_(seed) {}

    /// Coordinates from 0 to `size`, which is small enough for much to touch.
    OverlapCase on_grid(std::int64_t size) {
        OverlapCase out = {{}, {}, {}, 0, true};
        for (auto& corner : out.v) {
            for (std::int64_t& x : corner) x = below(size + 1);
        }
        for (int i = 0; i < kBoxes; ++i) {
            for (int a = 0; a < 3; ++a) set_side(out, i, a, below(size + 1), below(size + 1));
        }
        return out;
    }

    /// Any of all kinds.
    OverlapCase any() {
        if (random_.next() % 4 == 0) return on_grid(std::int64_t{1} << (1 + below(18)));
        OverlapCase out = {{}, {}, {}, 0, true};
        const int bits = static_cast<int>(2 + below(18));
        triangle(out, bits);
        for (int i = 0; i < kBoxes; ++i) {
            std::int64_t at[3];
            near_point(out, at);
            box(out, i, at, static_cast<int>(below(bits + 2)));
        }
        out.is_small = bits < 13;
        place(out);
        return out;
    }

private:
    std::int64_t below(std::int64_t end) {
        return static_cast<std::int64_t>(random_.next() % static_cast<std::uint64_t>(end));
    }
    /// From -2^bits to 2^(bits + 1), with many small values.
    std::int64_t about_zero(int bits) {
        return below(std::int64_t{2} << below(bits + 1)) - (std::int64_t{1} << below(bits + 1));
    }

    static void set_side(OverlapCase& out, int i, int a, std::int64_t from, std::int64_t to) {
        out.lower[a][i] = std::min(from, to), out.upper[a][i] = std::max(from, to);
    }

    /// Corners are multiples of 8, so that eighths of the way between them are integers.
    void triangle(OverlapCase& out, int bits) {
        for (auto& corner : out.v) {
            for (std::int64_t& x : corner) x = 8 * below(std::int64_t{2} << bits);
        }
        if (below(8) == 0) std::copy_n(out.v[0], 2, out.v[1]);  // an edge along an axis
        const std::int64_t kind = below(6);
        if (kind < 3) thin(out, kind == 0 ? 8 : kind - 1);
        if (below(6) == 0) flatten(out);
    }
    void flatten(OverlapCase& out) {
        const std::int64_t a = below(3);
        out.v[1][a] = out.v[2][a] = out.v[0][a];
    }
    /// Moves corner 2 to the line through the others, give or take: a sliver, a segment or a point.
    void thin(OverlapCase& out, std::int64_t deviation) {
        const std::int64_t eighths = below(9);
        for (int a = 0; a < 3; ++a) {
            const std::int64_t along = (out.v[1][a] - out.v[0][a]) / 8 * eighths;
            out.v[2][a] = out.v[0][a] + along + deviation * (below(3) - 1);
        }
        if (below(8) == 0) std::copy_n(out.v[0], 3, out.v[1]);
    }

    /// A point of the triangle: in eighths, so corners, edges and the inside all come up.
    void near_point(const OverlapCase& out, std::int64_t (&at)[3]) {
        const std::int64_t u = below(9), w = below(9 - u);
        for (int a = 0; a < 3; ++a) {
            at[a] = (out.v[0][a] * (8 - u - w) + out.v[1][a] * u + out.v[2][a] * w) / 8;
        }
        if (random_.next() % 2 == 0) return;
        for (std::int64_t& x : at) x += below(3) - 1;  // almost a point of it
    }

    /// A box with `at` as a corner, on an edge, on a face or inside.
    void box(OverlapCase& out, int i, const std::int64_t (&at)[3], int bits) {
        for (int a = 0; a < 3; ++a) {
            const std::int64_t down = below(3) == 0 ? about_zero(bits) : 0;
            const std::int64_t up = below(4) == 0 ? 0 : about_zero(bits);
            set_side(out, i, a, at[a] - down, at[a] + up);
        }
    }

    /// Scales by a power of two, from the smallest floats to the largest, and may move all far from
    /// the origin, as far as floats go that hold the coordinates.
    void place(OverlapCase& out) {
        constexpr int kSmallest = -149, kLargest = 127 - 41;
        out.unit_exponent = kSmallest + static_cast<int>(below(kLargest - kSmallest));
        if (below(2) == 0) out.unit_exponent = static_cast<int>(below(68)) - 68;
        const auto for_each = [&](int a, auto&& change) {
            for (auto& corner : out.v) change(corner[a]);
            for (int i = 0; i < kBoxes; ++i) change(out.lower[a][i]), change(out.upper[a][i]);
        };
        const std::int64_t kind = out.is_small ? below(4) : below(2);
        for (int a = 0; a < 3; ++a) {
            // An axis may be much longer than another, and only one axis far away.
            const int shift = kind == 1 ? static_cast<int>(below(17)) : 0;
            const std::int64_t far = kind == 2 ? below(std::int64_t{1} << 23) : 0;
            for_each(a, [&](std::int64_t& x) { x = (x << shift) + far; });
        }
        out.is_small &= kind == 0 || kind == 3;
    }

    tools::Random random_;
};

}  // namespace packet::test
