// Builds the `bvh-morton` hierarchy on the device.
#pragma once

#include "build/hierarchy.h"

#include <packet/accel.h>

#include <span>

namespace packet::cuda {

/// The hierarchy of build_bvh_morton(), node for node. References and nodes travel to the device
/// and back. Throws Error{kUnsupported} if there is no device or its memory does not suffice: about
/// 150 bytes a reference.
[[nodiscard]] Hierarchy build_bvh_morton(std::span<const Reference> references,
                                         const BuildOptions& options);

}  // namespace packet::cuda
