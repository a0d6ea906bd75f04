// Cuts a triangle down to a box: the arithmetic behind clip.h, the same for the CPU's threads and
// for those of CUDA.
//
// Sutherland, Hodgman. Reentrant polygon clipping. CACM 1974.
#pragma once

#include "core/macros.h"

#include <packet/bounds.h>

#include <glm/vec3.hpp>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

namespace packet {

// Rounding moves a corner by less than 2^-49 of the triangle's largest coordinate at each of seven
// planes. Planes are moved outward by more than their sum, so no point of the true part is ever cut
// off; the bounds are grown by as much. That is a two-millionth of the coordinate's ulp in float.
inline constexpr double kClipMargin = 0x1p-45;

// A plane can add half as many corners as there are, if rounding has made the outline zigzag about
// it: seven planes make 3 corners 4, 6, 9, 13, 19, 28, 42. Without rounding there are at most 10.
inline constexpr int kMaxCorners = 42;

struct Polygon {
    glm::dvec3 corner[kMaxCorners];
    int count = 0;

    Polygon() = default;
    constexpr Polygon(const Polygon& other) noexcept { *this = other; }
    /// Copies the corners that there are.
    constexpr Polygon& operator=(const Polygon& other) noexcept {
        if (this == &other) return *this;
        count = other.count;
        for (int i = 0; i < count; ++i) corner[i] = other.corner[i];
        return *this;
    }
    constexpr void add(const glm::dvec3& p) noexcept {
        PACKET_ASSERT(count < kMaxCorners);
        corner[count++] = p;
    }
};

enum class Keep { kAbove, kBelow };

/// The part of the polygon on one closed side of a plane across `axis`.
constexpr Polygon clip(const Polygon& in, int axis, double plane, Keep keep) noexcept {
    const double up = keep == Keep::kAbove ? 1.0 : -1.0;
    Polygon out;
    for (int i = 0; i < in.count; ++i) {
        const glm::dvec3& p = in.corner[i];
        const glm::dvec3& q = in.corner[i + 1 < in.count ? i + 1 : 0];
        const double hp = up * (p[axis] - plane), hq = up * (q[axis] - plane);
        if (hp >= 0.0) out.add(p);
        if ((hp >= 0.0) == (hq >= 0.0)) continue;
        glm::dvec3 crossing = p + (q - p) * (hp / (hp - hq));
        crossing[axis] = plane;
        out.add(crossing);
    }
    return out;
}

/// The greatest float below a finite one.
[[nodiscard]] constexpr float next_below(float x) noexcept {
    if (x == 0.0f) return -std::numeric_limits<float>::denorm_min();
    const auto bits = std::bit_cast<std::uint32_t>(x);
    return std::bit_cast<float>(x > 0.0f ? bits - 1 : bits + 1);
}

// Neither yields -0, which compares as 0: which of them is the least would depend on the order in
// which boxes are joined.
[[nodiscard]] constexpr float round_down(double x) noexcept {
    const auto f = static_cast<float>(x);
    return (static_cast<double>(f) <= x ? f : next_below(f)) + 0.0f;
}
[[nodiscard]] constexpr float round_up(double x) noexcept { return -round_down(-x) + 0.0f; }

/// A triangle as it is cut down to a box.
class TriangleClipper {
public:
    constexpr explicit TriangleClipper(const glm::vec3 (&corners)[3]) noexcept {
        double largest = 0.0;
        for (const glm::vec3& p : corners) {
            polygon_.add(glm::dvec3(p));
            bounds_.extend(p);
            for (int a = 0; a < 3; ++a) {
                largest = std::max(largest, static_cast<double>(p[a] < 0.0f ? -p[a] : p[a]));
            }
        }
        margin_ = kClipMargin * largest;
    }

    /// Leaves what is in the box. Faces that the triangle does not reach beyond cut nothing.
    constexpr void cut_to(const Bounds3f& box) noexcept {
        for (int a = 0; a < 3; ++a) {
            if (bounds_.lower[a] < box.lower[a]) cut(a, box.lower[a], Keep::kAbove);
            if (bounds_.upper[a] > box.upper[a]) cut(a, box.upper[a], Keep::kBelow);
        }
    }
    constexpr void cut(int axis, float plane, Keep keep) noexcept {
        const double outward = keep == Keep::kAbove ? -margin_ : margin_;
        polygon_ = clip(polygon_, axis, static_cast<double>(plane) + outward, keep);
    }
    /// The bounds of what is left, in the box that it was cut to.
    [[nodiscard]] constexpr Bounds3f bounds_in(const Bounds3f& box) const noexcept {
        Bounds3f out;
        if (polygon_.count == 0) return out;
        glm::dvec3 lower = polygon_.corner[0], upper = lower;
        for (int i = 1; i < polygon_.count; ++i) {
            lower = glm::min(lower, polygon_.corner[i]);
            upper = glm::max(upper, polygon_.corner[i]);
        }
        for (int a = 0; a < 3; ++a) {
            // Exact where a face of the box is the bound, as is a triangle's that lies in the face.
            out.lower[a] = std::max(box.lower[a], round_down(lower[a] - margin_));
            out.upper[a] = std::min(box.upper[a], round_up(upper[a] + margin_));
        }
        return out;
    }

private:
    Polygon polygon_;
    Bounds3f bounds_;
    double margin_ = 0.0;
};

/// The bounds of a triangle's parts on both sides of a plane that cuts `box`, which holds the part
/// that is cut: see cut_reference() of clip.h.
struct CutBounds {
    Bounds3f side[2];
};
[[nodiscard]] constexpr CutBounds cut_bounds(const glm::vec3 (&corners)[3], const Bounds3f& box,
                                             int axis, float position) noexcept {
    TriangleClipper below(corners);
    below.cut_to(box);
    TriangleClipper above = below;
    below.cut(axis, position, Keep::kBelow);
    above.cut(axis, position, Keep::kAbove);
    Bounds3f box0 = box, box1 = box;
    box0.upper[axis] = box1.lower[axis] = position;
    const Bounds3f part0 = below.bounds_in(box0), part1 = above.bounds_in(box1);
    // Only the margin let this triangle in here: its points are all in other cells.
    return {{part0.empty() && part1.empty() ? box0 : part0, part1}};
}

}  // namespace packet
