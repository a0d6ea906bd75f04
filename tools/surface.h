// The surface where a ray hits it, and the rays that go on from there.
#pragma once

#include "random.h"

#include <packet/hit.h>
#include <packet/ray.h>
#include <packet/scene.h>

#include <glm/vec3.hpp>

namespace packet::tools {

struct Surface {
    glm::vec3 origin;  ///< off the surface by more than rounding, on the side the ray came from
    glm::vec3 normal;  ///< of the triangle, towards that side, of length 1
};

/// The surface at a hit of `ray`, in the world.
[[nodiscard]] Surface surface_at(const Scene& scene, const Ray& ray, const Hit& hit);

/// A ray into the hemisphere about the normal, as likely as its cosine, of length `tfar`.
[[nodiscard]] Ray scatter(const Surface& surface, float tfar, Random& random);

/// The length of the diagonal of the scene's box.
[[nodiscard]] float diagonal(const Bounds3f& bounds);

/// The distance within which things darken an ambient occlusion image: a twentieth of the diagonal
/// darkens corners and cracks, and leaves rooms bright.
[[nodiscard]] inline float occlusion_distance(const Bounds3f& bounds) {
    return 0.05f * diagonal(bounds);
}

}  // namespace packet::tools
