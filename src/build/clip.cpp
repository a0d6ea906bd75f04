#include "build/clip.h"

#include "core/macros.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>

namespace packet {

namespace {

// Rounding moves a corner by less than 2^-49 of the triangle's largest coordinate at each of seven
// planes. Planes are moved outward by more than their sum, so no point of the true part is ever cut
// off; the bounds are grown by as much. That is a two-millionth of the coordinate's ulp in float.
constexpr double kMargin = 0x1p-45;

// A plane can add half as many corners as there are, if rounding has made the outline zigzag about
// it: seven planes make 3 corners 4, 6, 9, 13, 19, 28, 42. Without rounding there are at most 10.
constexpr int kMaxCorners = 42;

struct Polygon {
    glm::dvec3 corner[kMaxCorners];
    int count = 0;
};

enum class Keep { kAbove, kBelow };

/// The part of the polygon on one closed side of a plane across `axis`.
Polygon clip(const Polygon& in, int axis, double plane, Keep keep) {
    Polygon out;
    const auto height = [&](const glm::dvec3& p) {
        return keep == Keep::kAbove ? p[axis] - plane : plane - p[axis];
    };
    for (int i = 0; i < in.count; ++i) {
        const glm::dvec3& p = in.corner[i];
        const glm::dvec3& q = in.corner[i + 1 < in.count ? i + 1 : 0];
        const double hp = height(p), hq = height(q);
        if (hp >= 0.0) out.corner[out.count++] = p;
        if ((hp >= 0.0) == (hq >= 0.0)) continue;
        glm::dvec3 crossing = p + (q - p) * (hp / (hp - hq));
        crossing[axis] = plane;
        PACKET_ASSERT(out.count < kMaxCorners);
        out.corner[out.count++] = crossing;
    }
    return out;
}

float round_down(double x) {
    const auto f = static_cast<float>(x);
    return static_cast<double>(f) <= x ? f : std::nextafter(f, -INFINITY);
}

float round_up(double x) { return -round_down(-x); }

/// A triangle as it is cut down to a box.
class Clipper {
public:
    explicit Clipper(const glm::vec3 (&corners)[3]) {
        double largest = 0.0;
        for (const glm::vec3& p : corners) {
            polygon_.corner[polygon_.count++] = glm::dvec3(p);
            bounds_.extend(p);
            for (int a = 0; a < 3; ++a) {
                largest = std::max(largest, static_cast<double>(std::abs(p[a])));
            }
        }
        margin_ = kMargin * largest;
    }

    /// Leaves what is in the box. Faces that the triangle does not reach beyond cut nothing.
    void cut_to(const Bounds3f& box) {
        for (int a = 0; a < 3; ++a) {
            if (bounds_.lower[a] < box.lower[a]) cut(a, box.lower[a], Keep::kAbove);
            if (bounds_.upper[a] > box.upper[a]) cut(a, box.upper[a], Keep::kBelow);
        }
    }
    void cut(int axis, float plane, Keep keep) {
        const double outward = keep == Keep::kAbove ? -margin_ : margin_;
        polygon_ = clip(polygon_, axis, static_cast<double>(plane) + outward, keep);
    }
    /// The bounds of what is left, in the box that it was cut to.
    [[nodiscard]] Bounds3f bounds_in(const Bounds3f& box) const {
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

Reference with_bounds(const Reference& reference, const Bounds3f& box) {
    return {box.lower, reference.id, box.upper};
}

}  // namespace

Bounds3f clip_triangle(const glm::vec3 (&corners)[3], const Bounds3f& box) {
    Clipper clipper(corners);
    clipper.cut_to(box);
    return clipper.bounds_in(box);
}

CutReference cut_reference(MeshView mesh, const Reference& reference, int axis, float position) {
    PACKET_ASSERT(reference.lower[axis] < position && position < reference.upper[axis]);
    const glm::uvec3 triangle = mesh.triangles[reference.id];
    Clipper below(
        {mesh.positions[triangle.x], mesh.positions[triangle.y], mesh.positions[triangle.z]});
    below.cut_to(reference.bounds());
    Clipper above = below;
    below.cut(axis, position, Keep::kBelow);
    above.cut(axis, position, Keep::kAbove);
    Bounds3f box0 = reference.bounds(), box1 = box0;
    box0.upper[axis] = box1.lower[axis] = position;
    const Bounds3f part0 = below.bounds_in(box0), part1 = above.bounds_in(box1);
    // Only the margin let this reference in here: its triangle's points are all in other cells.
    if (part0.empty() && part1.empty()) {
        return {{with_bounds(reference, box0), with_bounds(reference, part1)}};
    }
    return {{with_bounds(reference, part0), with_bounds(reference, part1)}};
}

}  // namespace packet
