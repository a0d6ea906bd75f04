// Sets of rays as renderers trace them, from most to least coherent.
#pragma once

#include "camera.h"
#include "names.h"

#include <packet/ray.h>
#include <packet/scene.h>
#include <packet/trace.h>

#include <cstdint>
#include <string_view>
#include <vector>

namespace packet::tools {

enum class RayKind : std::uint8_t {
    kPrimary,  ///< through the pixels' centres, in scanline order
    kShadow,   ///< from what the primary rays hit to one point light, t = 1 at the light
    kAo,       ///< from there about the surface's normal, a twentieth of the scene's diagonal long
    kDiffuse,  ///< from there about the surface's normal, without end
    kRandom    ///< from anywhere in the scene's box into any direction, without end
};

inline constexpr Named<RayKind> kRayKinds[] = {{RayKind::kPrimary, "primary"},
                                               {RayKind::kShadow, "shadow"},
                                               {RayKind::kAo, "ao"},
                                               {RayKind::kDiffuse, "diffuse"},
                                               {RayKind::kRandom, "random"}};

/// Whether the rays start where other rays hit, so that the scene must be committed.
[[nodiscard]] constexpr bool needs_commit(RayKind kind) noexcept {
    return kind == RayKind::kShadow || kind == RayKind::kAo || kind == RayKind::kDiffuse;
}

/// As many rays as the image has pixels, the same for the same seed and any TraceOptions. Where a
/// kind starts from what the camera sees, pixels that see nothing give no ray; those that do then
/// give more, in scanline order from the first again, through other points of the pixel.
/// Throws Error{kBadValue} if the camera sees nothing at all, or the scene is empty (random).
[[nodiscard]] std::vector<Ray> make_rays(RayKind kind, const Scene& scene, const Camera& camera,
                                         std::uint64_t seed, const TraceOptions& options = {});

}  // namespace packet::tools
