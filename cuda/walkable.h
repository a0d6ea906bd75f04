// What of the CPU's structures devices can walk.
#pragma once

#include "core/views.h"

#include <cstddef>

namespace packet::cuda {

/// Throws Error{kUnsupported} that names the mesh unless it has what kernels walk: a tree (no grid)
/// in its binary form, of which all is copied to the device.
void require_walkable(const TreeView& tree, std::size_t mesh_id);

}  // namespace packet::cuda
