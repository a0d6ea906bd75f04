// The large cells of a k-d tree, level by level: every pass over a level runs over pieces of all
// its references, so that a few cells of many references keep as many threads busy as many of few.
//
// Zhou, Hou, Wang, Guo. Real-time KD-tree construction on graphics hardware. SIGGRAPH Asia 2008.
#pragma once

#include "build/hierarchy.h"
#include "build/kd_range.h"

#include <packet/accel.h>

namespace packet {

/// Cells of at most this many references are small: a set of them fits a word.
inline constexpr std::size_t kMaxSmallCell = 64;

struct KdLargeStage {
    ScratchVector<BuildNode> nodes;  ///< nodes[0] is the root; of the small cells only the places
    std::vector<KdLevel> small;      ///< the small cells that each level ended in
};

/// Cuts the root, the only cell of its level, until all cells are small. `share` is how much of the
/// phase this is.
[[nodiscard]] KdLargeStage run_large_stage(MeshView mesh, KdLevel root, const BuildOptions& options,
                                           const Parallel& parallel, double share);

}  // namespace packet
