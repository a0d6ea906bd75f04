#include "core/views.h"
#include "scene/triangle_fault.h"

#include <packet/error.h>
#include <packet/mesh.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace packet {

void validate(MeshView mesh) {
    constexpr std::size_t kMostTriangles = 0x7FFFFFFE;
    if (mesh.triangles.size() > kMostTriangles) {
        throw Error(ErrorCode::kTooLarge, "mesh has " + std::to_string(mesh.triangles.size()) +
                                              " triangles; at most " +
                                              std::to_string(kMostTriangles) + " can be named");
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint32_t vertex = mesh.triangles[i][corner];
            if (vertex < mesh.positions.size()) continue;
            throw Error(ErrorCode::kBadIndex, "triangle " + std::to_string(i) +
                                                  " refers to vertex " + std::to_string(vertex) +
                                                  " of " + std::to_string(mesh.positions.size()));
        }
    }
}

/// Whether a * b == c * d, exactly. Rounding is monotone, so products that round to different
/// numbers differ; if they round to the same, what was rounded off decides.
static bool products_equal(double a, double b, double c, double d) noexcept {
    const double ab = a * b, cd = c * d;
    return ab == cd && std::fma(a, b, -ab) == std::fma(c, d, -cd);
}

static bool is_collinear(const glm::vec3& v0, const glm::vec3& v1, const glm::vec3& v2) noexcept {
    double a[3], b[3];
    for (int i = 0; i < 3; ++i) {
        a[i] = static_cast<double>(v1[i]) - static_cast<double>(v0[i]);
        b[i] = static_cast<double>(v2[i]) - static_cast<double>(v0[i]);
    }
    return products_equal(a[1], b[2], a[2], b[1]) && products_equal(a[2], b[0], a[0], b[2]) &&
           products_equal(a[0], b[1], a[1], b[0]);
}

TriangleFault find_fault(const glm::vec3& v0, const glm::vec3& v1, const glm::vec3& v2) noexcept {
    float largest = 0.0f;
    for (const glm::vec3& v : {v0, v1, v2}) {
        for (int i = 0; i < 3; ++i) {
            if (!std::isfinite(v[i])) return TriangleFault::kNonFinite;
            largest = std::max(largest, std::fabs(v[i]));
        }
    }
    if (largest > kMaxCoordinate) return TriangleFault::kTooLarge;
    return is_collinear(v0, v1, v2) ? TriangleFault::kZeroArea : TriangleFault::kNone;
}

void add_fault(SkippedTriangles& skipped, TriangleFault fault) noexcept {
    skipped.non_finite += fault == TriangleFault::kNonFinite;
    skipped.too_large += fault == TriangleFault::kTooLarge;
    skipped.zero_area += fault == TriangleFault::kZeroArea;
}

}  // namespace packet
