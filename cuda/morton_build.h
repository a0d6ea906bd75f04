// Builds the `bvh-morton` hierarchy on the device.
#pragma once

#include "device_hierarchy.h"

#include <packet/accel.h>

namespace packet::cuda {

/// The hierarchy of build_bvh_morton(), its nodes in another order. Throws Error{kUnsupported} if
/// the device's memory does not suffice: about 150 bytes a reference.
[[nodiscard]] DeviceHierarchy build_bvh_morton(DeviceArray<Reference> references,
                                               std::uint32_t count, const BuildOptions& options);

}  // namespace packet::cuda
