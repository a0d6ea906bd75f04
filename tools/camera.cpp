// A pinhole camera.
#include "camera.h"

#include "usage_error.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace packet::tools {
namespace {

/// Axes of length 1 at right angles to each other.
struct Axes {
    glm::dvec3 right, up, forward;
};

/// Axes that look along `forward` with `up` upward, or if that is parallel, z or else y.
Axes look_along(const glm::dvec3& forward, const glm::dvec3& up) {
    const glm::dvec3 candidates[] = {up, {0.0, 0.0, 1.0}, {0.0, 1.0, 0.0}};
    Axes axes;
    axes.forward = glm::normalize(forward);
    for (const glm::dvec3& candidate : candidates) {
        axes.right = glm::cross(axes.forward, candidate);
        if (glm::length(axes.right) > 1e-6 * glm::length(candidate)) break;
    }
    axes.right = glm::normalize(axes.right);
    axes.up = glm::cross(axes.right, axes.forward);
    return axes;
}

/// The view of somebody who stands aside and above: three faces of a box are seen.
glm::dvec3 three_quarter_view(const glm::dvec3& up) {
    const Axes axes = look_along({0.0, 0.0, -1.0}, up);
    return axes.forward - axes.right - 0.8 * axes.up;
}

/// An eye's place relative to `at`, aside and ahead.
struct Place {
    double aside, ahead;
};

/// Along one axis of an image that reaches to `slope` on a plane at distance 1: the place nearest
/// to the box from which all of it is seen. The eye keeps looking at `at` if it may not go aside.
Place fit(const Bounds3f& box, const glm::dvec3& at, const glm::dvec3& axis,
          const glm::dvec3& forward, double slope, bool may_go_aside) {
    // A corner (x, z) is seen from (aside, ahead) if |x - aside| <= slope * (z - ahead).
    double most = -std::numeric_limits<double>::infinity(), least = most;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 point{(corner & 1 ? box.upper : box.lower).x,
                               (corner & 2 ? box.upper : box.lower).y,
                               (corner & 4 ? box.upper : box.lower).z};
        const double x = glm::dot(point - at, axis), z = glm::dot(point - at, forward);
        most = std::max(most, x - slope * z);
        least = std::max(least, -x - slope * z);
    }
    const double aside = may_go_aside ? 0.5 * (most - least) : 0.0;
    return {aside, -std::max(most - aside, least + aside) / slope};
}

/// Where all of the box is seen.
glm::dvec3 framing_eye(const Bounds3f& box, const glm::dvec3& at, const Axes& axes,
                       double half_width, double half_height, bool may_go_aside) {
    constexpr double kMargin = 0.95;  // some air around the scene
    const Place x = fit(box, at, axes.right, axes.forward, kMargin * half_width, may_go_aside);
    const Place y = fit(box, at, axes.up, axes.forward, kMargin * half_height, may_go_aside);
    const double ahead = std::min(x.ahead, y.ahead);
    return at + x.aside * axes.right + y.aside * axes.up +
           (ahead < 0.0 ? ahead : -1.0) * axes.forward;  // from a distance even if it is a point
}

}  // namespace

Camera::Camera(const CameraOptions& options, const Bounds3f& scene) : size_(options.size) {
    if (options.eye && options.at && *options.eye == *options.at) {
        throw UsageError("the camera's eye and what it looks at are the same point");
    }
    const double half_height = std::tan(glm::radians(0.5 * options.fov_degrees));
    const double half_width = half_height * size_.width / size_.height;

    const Bounds3f box = scene.empty() ? Bounds3f{glm::vec3(-1.0f), glm::vec3(1.0f)} : scene;
    const glm::dvec3 at(options.at.value_or(box.center()));
    glm::dvec3 forward = three_quarter_view(options.up);
    if (options.eye && glm::dvec3(*options.eye) != at) forward = at - glm::dvec3(*options.eye);
    const Axes axes = look_along(forward, options.up);
    eye_ = options.eye.value_or(
        glm::vec3(framing_eye(box, at, axes, half_width, half_height, !options.at)));

    right_ = axes.right * (2.0 * half_width / size_.width);
    down_ = axes.up * (-2.0 * half_height / size_.height);
    corner_ = axes.forward - half_width * axes.right + half_height * axes.up;
}

Ray Camera::ray(float x, float y) const noexcept {
    const glm::dvec3 direction = corner_ + double{x} * right_ + double{y} * down_;
    Ray ray;
    ray.org = eye_;
    ray.dir = glm::vec3(glm::normalize(direction));
    return ray;
}

}  // namespace packet::tools
