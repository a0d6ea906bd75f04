// Tells what rays are like from a sample of at most 64 runs of 8 neighbours.
#pragma once

#include <packet/bounds.h>
#include <packet/trace.h>

#include <limits>
#include <span>

namespace packet {

/// Whether neighbours start close together and go the same way in half of the sample or more; and
/// are `farthest` apart, at most, where they hit something. How far that is nobody knows yet: from
/// where they enter `world` on a part of its diagonal. O(1).
[[nodiscard]] bool are_coherent(std::span<const Ray> rays, const Bounds3f& world,
                                float farthest = std::numeric_limits<float>::infinity());

/// Whether neighbours start anywhere: only rays that come later, if any, start near them. O(1).
[[nodiscard]] bool are_scattered(std::span<const Ray> rays, const Bounds3f& world);

}  // namespace packet
