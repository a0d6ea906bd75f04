// Renders images.
#pragma once

#include "camera.h"
#include "image.h"
#include "shading.h"

#include <packet/scene.h>
#include <packet/trace.h>

namespace packet::tools {

/// An image of the scene, which must be committed: `samples` rays a pixel (0 takes the shading's
/// own number), a single one through its middle, several at random. The image is the same for any
/// Tracer and TraceOptions. Shows its progress on a terminal.
[[nodiscard]] Image render(const Scene& scene, const Camera& camera, const Shading& shading,
                           int samples, const Tracer& tracer);
[[nodiscard]] Image render(const Scene& scene, const Camera& camera, const Shading& shading,
                           int samples = 0, const TraceOptions& options = {});

}  // namespace packet::tools
