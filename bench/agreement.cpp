#include "agreement.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>

namespace packet::bench {
namespace {

constexpr double kDistanceTolerance = 1e-5;
// A hit nearer to its triangle's border than this, in barycentric coordinates, is a matter of
// rounding: single precision resolves small triangles far from the origin no better.
constexpr double kBorder = 1e-3;
constexpr double kMostDifferent = 5e-6;  // of all rays

float largest_coordinate(const glm::vec3& p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

float largest_coordinate(MeshView mesh) {
    float largest = 0.0f;
    for (const glm::vec3& p : mesh.positions) {
        const float coordinate = largest_coordinate(p);
        if (std::isfinite(coordinate)) largest = std::max(largest, coordinate);
    }
    return largest;
}

double distance_tolerance(const Ray& ray, float t, float scene_coordinate) {
    const double length = glm::length(glm::dvec3(ray.dir));
    const float coordinate = std::max(scene_coordinate, largest_coordinate(ray.org));
    return kDistanceTolerance * std::max<double>(t, coordinate / length);
}

// Whether the ray surely meets the triangle of the hit at about its t. Möller and Trumbore. Fast,
// minimum storage ray-triangle intersection. Journal of Graphics Tools 1997.
bool is_sure(MeshView mesh, const Ray& ray, const Hit& hit, double tolerance) {
    const glm::uvec3 corners = mesh.triangles[hit.prim_id];
    const glm::dvec3 v0 = mesh.positions[corners.x];
    const glm::dvec3 e1 = glm::dvec3(mesh.positions[corners.y]) - v0;
    const glm::dvec3 e2 = glm::dvec3(mesh.positions[corners.z]) - v0;
    const glm::dvec3 dir = ray.dir;
    const glm::dvec3 s = glm::dvec3(ray.org) - v0;
    const glm::dvec3 p = glm::cross(dir, e2);
    const glm::dvec3 q = glm::cross(s, e1);
    const double determinant = glm::dot(e1, p);
    const double u = glm::dot(s, p) / determinant;
    const double v = glm::dot(dir, q) / determinant;
    const double t = glm::dot(e2, q) / determinant;
    // False for the NaN of a triangle seen edge on.
    return std::min({u, v, 1.0 - u - v}) > kBorder && std::abs(t - hit.t) <= tolerance &&
           ray.tnear + tolerance < t && t < ray.tfar - tolerance;
}

}  // namespace

bool Agreement::acceptable() const noexcept {
    return static_cast<double>(different) <= kMostDifferent * static_cast<double>(rays());
}

Agreement compare_hits(MeshView mesh, std::span<const Ray> rays, std::span<const Hit> ours,
                       std::span<const Hit> theirs) {
    const float scene_coordinate = largest_coordinate(mesh);
    Agreement out;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Hit& a = ours[i];
        const Hit& b = theirs[i];
        const Hit& nearer = a.t <= b.t ? a : b;
        const double tolerance = distance_tolerance(rays[i], nearer.t, scene_coordinate);
        const bool both_missed = !a.is_hit() && !b.is_hit();
        if (both_missed || (a.is_hit() && b.is_hit() && std::abs(a.t - b.t) <= tolerance)) {
            ++(a.prim_id == b.prim_id ? out.same : out.tied);
        } else {
            ++(is_sure(mesh, rays[i], nearer, tolerance) ? out.different : out.borderline);
        }
    }
    return out;
}

}  // namespace packet::bench
