// What is built on the device, by its name.
#pragma once

#include "device_hierarchy.h"

#include <packet/accel.h>

namespace packet::cuda {

/// The hierarchy that `options.accel` names. Throws Error{kUnsupported} for what is not built on
/// devices.
[[nodiscard]] DeviceHierarchy build_hierarchy(const UploadedMesh& mesh,
                                              const BuildOptions& options);

}  // namespace packet::cuda
