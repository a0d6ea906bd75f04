// The small cells of a k-d tree, each cut up by one task to the leaves: what planes to choose from
// and which references they part is worked out once for all of a small cell.
//
// Zhou, Hou, Wang, Guo. Real-time KD-tree construction on graphics hardware. SIGGRAPH Asia 2008.
#pragma once

#include "build/kd_large_stage.h"

namespace packet {

/// Cuts the small cells up to the leaves. `share` is how much of the phase this is.
[[nodiscard]] Hierarchy run_small_stage(MeshView mesh, KdLargeStage large, int max_cut_depth,
                                        const BuildOptions& options, const Parallel& parallel,
                                        double share);

}  // namespace packet
