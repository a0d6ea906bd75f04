// Affine transforms of instances: inverted, applied to boxes, and bounded in what rounding does.
#pragma once

#include <packet/bounds.h>

#include <glm/mat4x3.hpp>

namespace packet {

struct ObjectFromWorld {
    float row[3][4];  ///< the last column is the translation
    /// Infinity norm of |M^-1| |M|, which bounds how much M magnifies relative errors. At least 1.
    float condition;
};

/// Throws Error{kBadValue} that begins with `what` if the transform is not finite, or so near to
/// singular that its inverse has no meaning in float (condition beyond 1e6).
[[nodiscard]] ObjectFromWorld invert(const glm::mat4x3& world_from_object, const char* what);

/// A box that holds the transformed box, rounded outwards. Empty stays empty.
[[nodiscard]] Bounds3f transform(const glm::mat4x3& m, const Bounds3f& box) noexcept;

/// The point, computed in double and rounded once.
[[nodiscard]] glm::vec3 transform(const glm::mat4x3& m, const glm::vec3& point) noexcept;

}  // namespace packet
