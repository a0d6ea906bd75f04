// A pinhole camera.
#pragma once

#include <packet/bounds.h>
#include <packet/ray.h>

#include <glm/vec3.hpp>

#include <cstddef>
#include <optional>

namespace packet::tools {

/// In pixels.
struct ImageSize {
    int width = 1280;
    int height = 720;

    [[nodiscard]] std::size_t pixel_count() const noexcept {
        return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    }
};

struct CameraOptions {
    /// Where the camera is. Without one it looks from above and aside, from as near as it can be to
    /// see the whole scene.
    std::optional<glm::vec3> eye;
    /// What is in the middle of the image. Without one, what is in the middle of the scene.
    std::optional<glm::vec3> at;
    /// What is upward in the image. If it is parallel to the view, an axis takes its place.
    glm::vec3 up{0.0f, 1.0f, 0.0f};
    /// The image's height as an angle, above 0 and below 180.
    float fov_degrees = 45.0f;
    ImageSize size;
};

class Camera {
public:
    /// Throws Error{kBadValue} if both `eye` and `at` are given and equal.
    Camera(const CameraOptions& options, const Bounds3f& scene);

    /// The ray through a point of the image in pixels: (0, 0) is the upper left corner of the
    /// image, (0.5, 0.5) the middle of its first pixel. Its direction has length 1.
    [[nodiscard]] Ray ray(float x, float y) const noexcept;

    [[nodiscard]] ImageSize size() const noexcept { return size_; }
    [[nodiscard]] const glm::vec3& eye() const noexcept { return eye_; }

private:
    ImageSize size_;
    glm::vec3 eye_;
    // In doubles, for scenes whose size is near the end of the floats' range.
    glm::dvec3 corner_;        // of the image, upper left, on a plane before the eye
    glm::dvec3 right_, down_;  // one pixel on that plane
};

}  // namespace packet::tools
