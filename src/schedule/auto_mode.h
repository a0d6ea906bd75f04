// Tells what rays are like from a sample of at most 64 runs of neighbours.
#pragma once

#include "schedule/pixel_layout.h"

#include <packet/bounds.h>
#include <packet/trace.h>

#include <span>

namespace packet {

/// Whether neighbours start close together and go the same way in half of the sample or more. O(1).
[[nodiscard]] bool are_coherent(std::span<const Ray> rays, const Bounds3f& world);

/// How far a ray goes that starts at `org`, which nobody knows yet: to where it enters `world`, and
/// on a part of its diagonal. O(1).
[[nodiscard]] float distance_to_hit(const glm::vec3& org, const Bounds3f& world);

/// Whether rays of a tile, a block of pixels if they are an image's, mostly hit the same leaves, if
/// these are `leaf_spacing` apart, about where they hit something. O(1).
[[nodiscard]] bool share_leaves(std::span<const Ray> rays, const PixelLayout& image,
                                const Bounds3f& world, float leaf_spacing);

/// Whether neighbours start anywhere: only rays that come later, if any, start near them. O(1).
[[nodiscard]] bool are_scattered(std::span<const Ray> rays, const Bounds3f& world);

}  // namespace packet
