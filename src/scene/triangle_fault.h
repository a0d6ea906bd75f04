// Why a triangle can never be hit, if so. Builders leave such triangles out; the oracle of the
// tests asks the same question, and so do builds on CUDA devices.
#pragma once

#include "core/macros.h"
#include "core/views.h"

#include <packet/mesh.h>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace packet {

enum class TriangleFault : std::uint8_t { kNone, kNonFinite, kTooLarge, kZeroArea };

/// Whether a * b == c * d, exactly. Rounding is monotone, so products that round to different
/// numbers differ; if they round to the same, what was rounded off decides.
PACKET_INLINE bool products_equal(double a, double b, double c, double d) noexcept {
    const double ab = a * b, cd = c * d;
    return ab == cd && std::fma(a, b, -ab) == std::fma(c, d, -cd);
}

PACKET_INLINE bool is_collinear(const glm::vec3& v0, const glm::vec3& v1,
                                const glm::vec3& v2) noexcept {
    double a[3], b[3];
    for (int i = 0; i < 3; ++i) {
        a[i] = static_cast<double>(v1[i]) - static_cast<double>(v0[i]);
        b[i] = static_cast<double>(v2[i]) - static_cast<double>(v0[i]);
    }
    return products_equal(a[1], b[2], a[2], b[1]) && products_equal(a[2], b[0], a[0], b[2]) &&
           products_equal(a[0], b[1], a[1], b[0]);
}

/// Exact: zero area means that the corners lie on one line as the numbers they are, not about so.
/// (Where exponents within a triangle differ by more than 2^29, differences of corners are
/// rounded.)
[[nodiscard]] PACKET_INLINE TriangleFault find_fault(const glm::vec3& v0, const glm::vec3& v1,
                                                     const glm::vec3& v2) noexcept {
    float largest = 0.0f;
    for (int i = 0; i < 9; ++i) {
        const float x = std::fabs((i < 3 ? v0 : i < 6 ? v1 : v2)[i % 3]);
        if (!(x <= std::numeric_limits<float>::max())) return TriangleFault::kNonFinite;
        largest = std::max(largest, x);
    }
    if (largest > kMaxCoordinate) return TriangleFault::kTooLarge;
    return is_collinear(v0, v1, v2) ? TriangleFault::kZeroArea : TriangleFault::kNone;
}

/// Counts a fault under its reason; kNone counts nowhere.
void add_fault(SkippedTriangles& skipped, TriangleFault fault) noexcept;

}  // namespace packet
