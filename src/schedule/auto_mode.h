// Picks a mode by looking at the rays.
#pragma once

#include <packet/isa.h>
#include <packet/scene.h>
#include <packet/trace.h>

#include <span>

namespace packet {

/// The mode that suits the rays, judged from a sample of at most 64 runs of 8 neighbours: tiles if
/// most runs start close together and go the same way, single rays else. O(1).
[[nodiscard]] Mode choose_mode(std::span<const Ray> rays, const Bounds3f& world);

}  // namespace packet
