#include "scene/transform.h"

#include <packet/error.h>

#include <glm/ext/matrix_double4x3.hpp>
#include <glm/ext/vector_double3.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <cmath>
#include <string>

namespace packet {

/// Largest row sum of |a| |b|.
static double product_norm(const glm::dmat3& a, const glm::dmat3& b) {
    double norm = 0.0;
    for (int row = 0; row < 3; ++row) {
        double sum = 0.0;
        for (int column = 0; column < 3; ++column) {
            for (int k = 0; k < 3; ++k) sum += std::abs(a[k][row]) * std::abs(b[column][k]);
        }
        norm = std::fmax(norm, sum);
    }
    return norm;
}

ObjectFromWorld invert(const glm::mat4x3& world_from_object, const char* what) {
    constexpr double kWorstCondition = 1e6;
    const glm::dmat4x3 m(world_from_object);
    const glm::dmat3 linear(m[0], m[1], m[2]);
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 3; ++row) {
            if (std::isfinite(m[column][row])) continue;
            throw Error(ErrorCode::kBadValue, std::string(what) + " is not finite at row " +
                                                  std::to_string(row) + ", column " +
                                                  std::to_string(column));
        }
    }
    const bool has_inverse = glm::determinant(linear) != 0.0;
    const glm::dmat3 inverse = has_inverse ? glm::inverse(linear) : glm::dmat3(0.0);
    const double condition = product_norm(linear, inverse);
    if (!has_inverse || condition > kWorstCondition) {
        throw Error(ErrorCode::kBadValue, std::string(what) + " is singular: it has no inverse");
    }
    const glm::dvec3 translation = -(inverse * m[3]);
    ObjectFromWorld out;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            out.row[row][column] = static_cast<float>(inverse[column][row]);
        }
        out.row[row][3] = static_cast<float>(translation[row]);
        for (const float x : out.row[row]) {
            if (std::isfinite(x)) continue;
            throw Error(ErrorCode::kBadValue, std::string(what) + " has an inverse beyond float");
        }
    }
    out.condition = static_cast<float>(std::fmax(condition, 1.0));
    return out;
}

Bounds3f transform(const glm::mat4x3& m, const Bounds3f& box) noexcept {
    if (box.empty()) return {};
    Bounds3f out;
    for (int corner = 0; corner < 8; ++corner) {
        out.extend(transform(m, glm::vec3((corner & 1) != 0 ? box.upper.x : box.lower.x,
                                          (corner & 2) != 0 ? box.upper.y : box.lower.y,
                                          (corner & 4) != 0 ? box.upper.z : box.lower.z)));
    }
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (int a = 0; a < 3; ++a) {
        out.lower[a] = std::nextafter(out.lower[a], -kInfinity);
        out.upper[a] = std::nextafter(out.upper[a], kInfinity);
    }
    return out;
}

glm::vec3 transform(const glm::mat4x3& m, const glm::vec3& point) noexcept {
    const glm::dvec3 p(point);
    const glm::dmat4x3 d(m);
    return glm::vec3(d[0] * p.x + d[1] * p.y + d[2] * p.z + d[3]);
}

}  // namespace packet
