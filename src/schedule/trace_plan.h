// What rays are traced by: as asked for, or as they and the query suggest.
#pragma once

#include "kernels/kernel_table.h"
#include "scene/scene_accel.h"

#include <packet/trace.h>

#include <span>

namespace packet {

enum class TraceQuery { kClosest, kAny };

struct TracePlan {
    KernelTable::Kernel kernel;
    bool is_sorted = false;    ///< whether the rays are sorted first
    bool is_trial = false;     ///< whether packets are tried, too
    bool by_treelets = false;  ///< by kernels of their own
};

/// `Mode::kAuto` looks at a sample of the rays: docs/benchmarking.md#beside-embree. O(1).
[[nodiscard]] TracePlan make_plan(const SceneAccel& scene, std::span<const Ray> rays,
                                  TraceQuery query, Mode mode);

}  // namespace packet
