// Numbers what became of small cells as the CPU does: cell by cell, and in each depth first.
#pragma once

#include "kd_step.h"

namespace packet::cuda {

/// Nodes of a batch of small cells, as they came about level by level: the first are those of the
/// small cells, and the children of a node are of a later level.
struct KdBatchNodes {
    KdNodes nodes;
    std::vector<std::uint32_t> level_ends;  ///< nodes there were after each level
};

/// Appends the batch to the hierarchy; `leaves` are its leaves. Nodes of the small cells `roots`
/// are copied to their places there, too.
void append_batch(const KdBatchNodes& batch, const KdDeviceLevel& leaves, const KdSetCell* roots,
                  std::uint32_t root_count, DeviceHierarchy& out, const Stream& stream);

}  // namespace packet::cuda
