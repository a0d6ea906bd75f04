// Builds the k-d tree of build/kd_levels.h on the device: breadth-first, the large cells level by
// level, then the small ones, some thousands at a time, level by level too.
//
// Zhou, Hou, Wang, Guo. Real-time KD-tree construction on graphics hardware. SIGGRAPH Asia 2008.
#pragma once

#include "device_hierarchy.h"

#include <packet/accel.h>

namespace packet::cuda {

/// The hierarchy of build_kd_levels(), node for node, of the references that collect_references()
/// yields for the mesh. Throws Error{kUnsupported} if the device's memory does not suffice (about
/// 350 bytes a reference of the largest level, with those that cuts add, and up to 130 MB of
/// masks), and Error{kTooLarge} for more than 2^29 references that may come about.
[[nodiscard]] DeviceHierarchy build_kd_levels(const UploadedMesh& mesh,
                                              DeviceArray<Reference> references,
                                              std::uint32_t reference_count,
                                              const BuildOptions& options);

}  // namespace packet::cuda
