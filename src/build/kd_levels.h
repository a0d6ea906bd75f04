// The k-d tree by the surface area heuristic, built level by level from flat arrays, as a GPU
// would: large cells by passes over all references of a level (kd_large_stage.h), small ones each
// by one task (kd_small_stage.h). Which planes may cut, when a cell becomes a leaf and how
// triangles are cut is as in kd_tree.cpp; but of the planes of a large cell only some are looked
// at, and in a small one none of those where cuts have made boxes smaller.
//
// Zhou, Hou, Wang, Guo. Real-time KD-tree construction on graphics hardware. SIGGRAPH Asia 2008.
#pragma once

#include "build/hierarchy.h"

#include <packet/accel.h>

namespace packet {

/// Boxes of the build have no -0, nor have parts that are cut of them, so that bounds are the same
/// in whatever order boxes are joined.
[[nodiscard]] constexpr Bounds3f without_negative_zero(const Bounds3f& box) noexcept {
    return {box.lower + 0.0f, box.upper + 0.0f};
}

/// As build_kd_tree() by KdRule::kSah, of at most kMaxReferences references.
[[nodiscard]] Hierarchy build_kd_levels(MeshView mesh, ScratchVector<Reference> references,
                                        const BuildOptions& options, const Parallel& parallel);

}  // namespace packet
