// Triangle-box overlap in integers, where nothing is rounded: what the kernels are held to. Two
// ways that share nothing with each other: all 13 separating axes, on any integers wide enough, and
// clipping the triangle to the box in rational numbers, for small coordinates.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace packet::test {

__extension__ using Int128 = __int128;

/// A triangle and a box in integer coordinates.
template <class Int>
struct IntegerPair {
    Int v[3][3], lower[3], upper[3];
};

/// 1024 bits in two's complement: as many as three floats' product may need, in units of the
/// smallest float's.
struct Wide {
    static constexpr std::size_t kWords = 32;
    std::uint32_t word[kWords] = {};

    /// `a` in units of the smallest float.
    static Wide from(float a) {
        const std::uint32_t bits = std::bit_cast<std::uint32_t>(std::fabs(a));
        const std::uint32_t exponent = bits >> 23, shift = exponent == 0 ? 0 : exponent - 1;
        const std::uint64_t mantissa = (bits & 0x7FFFFFu) | (exponent == 0 ? 0 : 0x800000u);
        Wide out;
        out.word[shift / 32] = static_cast<std::uint32_t>(mantissa << shift % 32);
        out.word[shift / 32 + 1] = static_cast<std::uint32_t>(mantissa << shift % 32 >> 32);
        return std::signbit(a) ? Wide{} - out : out;
    }
    friend Wide operator+(const Wide& a, const Wide& b) {
        Wide out;
        std::uint64_t sum = 0;
        for (std::size_t i = 0; i < kWords; ++i, sum >>= 32) {
            sum += std::uint64_t{a.word[i]} + b.word[i];
            out.word[i] = static_cast<std::uint32_t>(sum);
        }
        return out;
    }
    friend Wide operator-(const Wide& a, const Wide& b) {
        Wide out;
        std::uint64_t borrow = 0;
        for (std::size_t i = 0; i < kWords; ++i) {
            const std::uint64_t difference = std::uint64_t{a.word[i]} - b.word[i] - borrow;
            out.word[i] = static_cast<std::uint32_t>(difference);
            borrow = difference >> 63;
        }
        return out;
    }
    friend Wide operator*(const Wide& a, const Wide& b) {
        Wide out;
        for (std::size_t i = 0; i < kWords; ++i) {
            std::uint64_t carry = 0;
            for (std::size_t j = 0; i + j < kWords; ++j, carry >>= 32) {
                carry += std::uint64_t{a.word[i]} * b.word[j] + out.word[i + j];
                out.word[i + j] = static_cast<std::uint32_t>(carry);
            }
        }
        return out;
    }
    [[nodiscard]] bool is_negative() const { return word[kWords - 1] >> 31 != 0; }
    friend bool operator<(const Wide& a, const Wide& b) { return (a - b).is_negative(); }
};

template <class Int>
void swap_if_greater(Int& a, Int& b) {
    if (!(b < a)) return;
    const Int larger = a;
    a = b, b = larger;
}

/// Whether triangle and box have shadows on the axis that do not even touch.
template <class Int>
bool apart_along(const IntegerPair<Int>& pair, const Int (&axis)[3]) {
    Int corner[3] = {}, low = {}, high = {};
    for (int a = 0; a < 3; ++a) {
        for (int k = 0; k < 3; ++k) corner[k] = corner[k] + axis[a] * (pair.v[k][a] - pair.v[0][a]);
        Int from = axis[a] * (pair.lower[a] - pair.v[0][a]);
        Int to = axis[a] * (pair.upper[a] - pair.v[0][a]);
        swap_if_greater(from, to);
        low = low + from, high = high + to;
    }
    swap_if_greater(corner[0], corner[1]);
    swap_if_greater(corner[1], corner[2]);
    swap_if_greater(corner[0], corner[1]);
    return high < corner[0] || corner[2] < low;
}

/// By separating axes. Needs integers three times as wide as the coordinates, and 4 bits.
template <class Int>
bool overlap_in_integers(const IntegerPair<Int>& pair) {
    for (int a = 0; a < 3; ++a) {
        if (pair.upper[a] < pair.v[0][a] && pair.upper[a] < pair.v[1][a] &&
            pair.upper[a] < pair.v[2][a]) {
            return false;
        }
        if (pair.v[0][a] < pair.lower[a] && pair.v[1][a] < pair.lower[a] &&
            pair.v[2][a] < pair.lower[a]) {
            return false;
        }
    }
    Int edge[3][3], normal[3];
    for (int k = 0; k < 3; ++k) {
        for (int a = 0; a < 3; ++a) edge[k][a] = pair.v[(k + 1) % 3][a] - pair.v[k][a];
    }
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        normal[a] = edge[0][b] * edge[1][c] - edge[0][c] * edge[1][b];
    }
    if (apart_along(pair, normal)) return false;
    for (const auto& side : edge) {
        for (int a = 0; a < 3; ++a) {
            Int axis[3] = {};
            axis[(a + 1) % 3] = Int{} - side[(a + 2) % 3];
            axis[(a + 2) % 3] = side[(a + 1) % 3];
            if (apart_along(pair, axis)) return false;
        }
    }
    return true;
}

/// A point with rational coordinates x / w, y / w, z / w, w > 0, in lowest terms.
struct RationalPoint {
    Int128 x[3], w;
};

inline RationalPoint reduce(RationalPoint p) {
    Int128 divisor = p.w;
    for (Int128 a : p.x) {
        for (a = a < 0 ? -a : a; a != 0;) {
            const Int128 rest = divisor % a;
            divisor = a, a = rest;
        }
    }
    for (Int128& a : p.x) a /= divisor;
    p.w /= divisor;
    return p;
}

/// The part of a convex polygon, of any number of corners, where sign * (x[a] - plane) >= 0.
inline std::vector<RationalPoint> clip(const std::vector<RationalPoint>& polygon, int a, int sign,
                                       std::int64_t plane) {
    std::vector<RationalPoint> out;
    const auto distance = [&](const RationalPoint& p) { return sign * (p.x[a] - plane * p.w); };
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const RationalPoint &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
        const Int128 at_p = distance(p), at_q = distance(q);
        if (at_p >= 0) out.push_back(p);
        if ((at_p < 0 && at_q > 0) || (at_p > 0 && at_q < 0)) {
            const Int128 of_p = at_q < 0 ? -at_q : at_q, of_q = at_p < 0 ? -at_p : at_p;
            RationalPoint r = {{}, of_p * p.w + of_q * q.w};
            for (int i3 = 0; i3 < 3; ++i3) r.x[i3] = of_p * p.x[i3] + of_q * q.x[i3];
            out.push_back(reduce(r));
        }
    }
    return out;
}

/// By clipping. For coordinates of a few bits.
inline bool overlap_in_rationals(const IntegerPair<std::int64_t>& pair) {
    std::vector<RationalPoint> polygon;
    for (const auto& v : pair.v) polygon.push_back({{v[0], v[1], v[2]}, 1});
    for (int a = 0; a < 3; ++a) {
        polygon = clip(polygon, a, 1, pair.lower[a]);
        polygon = clip(polygon, a, -1, pair.upper[a]);
    }
    return !polygon.empty();
}

}  // namespace packet::test
