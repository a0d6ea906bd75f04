// Pictures of where rays visit many nodes, one a structure, in one colour scale.
#pragma once

#include <camera.h>

#include <filesystem>
#include <span>
#include <vector>

namespace packet::bench {

/// Writes heat-bvh.png and so on into the folder, which is made if there is none, and returns the
/// number of nodes that is shown as the palest colour. `nodes` are by structure, in the order of
/// accel_names(), and pixel.
float write_heat_pictures(std::span<const std::vector<float>> nodes, tools::ImageSize size,
                          const std::filesystem::path& folder);

}  // namespace packet::bench
