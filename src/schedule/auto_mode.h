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

/// Whether neighbours start anywhere, judged from as many: only rays that come later, if any,
/// start near them. O(1).
[[nodiscard]] bool are_scattered(std::span<const Ray> rays, const Bounds3f& world);

}  // namespace packet
