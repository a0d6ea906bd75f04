// What rays are traced by: as asked for, or as they and the query suggest.
#pragma once

#include "kernels/kernel_table.h"
#include "scene/scene_accel.h"

#include <packet/trace.h>

#include <span>

namespace packet {

enum class TraceQuery { kClosest, kAny };

/// How rays are sorted before they are traced.
enum class Sorting {
    kNone,
    kByTask,   ///< each task its own: as soon as they are needed
    kTogether  ///< by millions: where neighbours are scattered, those that belong together are far
};

/// How often packets of 16 are tried beside the planned kernel, if at all.
inline constexpr std::size_t kTrialPairs = 9;

struct TracePlan {
    KernelTable::Kernel kernel;
    Sorting sorting = Sorting::kNone;
    std::size_t least_wins = 0;  ///< of kTrialPairs, for packets of 16 to be taken; 0: no trial
    bool by_treelets = false;    ///< by kernels of their own
};

/// `Mode::kAuto` looks at a sample of the rays: docs/benchmarking.md#beside-embree. O(1).
[[nodiscard]] TracePlan make_plan(const SceneAccel& scene, std::span<const Ray> rays,
                                  TraceQuery query, Mode mode, int threads);

}  // namespace packet
