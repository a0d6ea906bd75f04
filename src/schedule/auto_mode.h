// Tells what rays are like from a sample of at most 64 runs of neighbours.
#pragma once

#include <packet/bounds.h>
#include <packet/trace.h>

#include <span>

namespace packet {

/// Whether neighbours start close together and go the same way in half of the sample or more. O(1).
[[nodiscard]] bool are_coherent(std::span<const Ray> rays, const Bounds3f& world);

/// Whether rays of a tile mostly hit the same leaves, if these are `leaf_spacing` apart. How far
/// rays go nobody knows yet: from where they enter `world` on a part of its diagonal. `width` as
/// in TraceOptions. O(1).
[[nodiscard]] bool share_leaves(std::span<const Ray> rays, int width, const Bounds3f& world,
                                float leaf_spacing);

/// Whether neighbours start anywhere: only rays that come later, if any, start near them. O(1).
[[nodiscard]] bool are_scattered(std::span<const Ray> rays, const Bounds3f& world);

}  // namespace packet
