// The k-d tree by the surface area heuristic, built level by level.
//
// Zhou, Hou, Wang, Guo. Real-time KD-tree construction on graphics hardware. SIGGRAPH Asia 2008.
#pragma once

#include "build/hierarchy.h"

#include <packet/accel.h>

namespace packet {

[[nodiscard]] Hierarchy build_kd_breadth_first(MeshView mesh, AlignedVector<Reference> references,
                                               const BuildOptions& options,
                                               const Parallel& parallel);

}  // namespace packet
