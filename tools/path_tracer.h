// A small path tracer: everything is white clay, the only light is a sky.
#pragma once

#include "shading.h"

namespace packet::tools {

/// Shades by following each ray through a few random bounces to the sky. Paths that do not get
/// there bring no light.
void shade_path(const Sight& sight, std::span<glm::vec3> colors);

}  // namespace packet::tools
