// An axis-aligned box.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <limits>

namespace packet {

/// The closed box from `lower` to `upper`. A default one is empty and extends to whatever it meets.
struct Bounds3f {
    glm::vec3 lower{std::numeric_limits<float>::infinity()};
    glm::vec3 upper{-std::numeric_limits<float>::infinity()};

    constexpr void extend(const glm::vec3& point) noexcept {
        lower = glm::min(lower, point);
        upper = glm::max(upper, point);
    }
    constexpr void extend(const Bounds3f& other) noexcept {
        lower = glm::min(lower, other.lower);
        upper = glm::max(upper, other.upper);
    }
    [[nodiscard]] constexpr bool empty() const noexcept {
        return !(lower.x <= upper.x && lower.y <= upper.y && lower.z <= upper.z);
    }
    [[nodiscard]] bool contains(const Bounds3f& other) const noexcept {
        return lower.x <= other.lower.x && lower.y <= other.lower.y && lower.z <= other.lower.z &&
               other.upper.x <= upper.x && other.upper.y <= upper.y && other.upper.z <= upper.z;
    }
    [[nodiscard]] glm::vec3 center() const noexcept { return 0.5f * lower + 0.5f * upper; }
    [[nodiscard]] constexpr glm::vec3 extent() const noexcept {
        return empty() ? glm::vec3(0.0f) : upper - lower;
    }
    /// Half the surface area, the measure of the surface area heuristic. Zero for an empty box.
    [[nodiscard]] constexpr float half_area() const noexcept {
        const glm::vec3 e = extent();
        return e.x * e.y + e.y * e.z + e.z * e.x;
    }

    friend bool operator==(const Bounds3f&, const Bounds3f&) = default;
};

}  // namespace packet
