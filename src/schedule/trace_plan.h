// What rays are traced by: as asked for, or as they and the query suggest.
#pragma once

#include "kernels/kernel_table.h"
#include "scene/scene_accel.h"
#include "schedule/pixel_layout.h"

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

struct TracePlan {
    KernelTable::Kernel kernel;
    Sorting sorting = Sorting::kNone;
    /// Packets of 16 are tried beside the kernel, and taken if they take less than this share of
    /// its time; 0: they are not.
    double packets_below = 0.0;
    bool by_treelets = false;  ///< by kernels of their own
    PixelLayout image = {};    ///< the order of unsorted rays, if they are an image's
};

/// By the mode and the width of `options`, and `threads` of their own. `Mode::kAuto` looks at a
/// sample of the rays: docs/experiments.md#tiles-and-single-rays. O(1), but that of closest-hit
/// rays that cohere it looks for lines of an image: at a 32nd of them, and 16,384, at most.
[[nodiscard]] TracePlan make_plan(const SceneAccel& scene, std::span<const Ray> rays,
                                  TraceQuery query, const TraceOptions& options, int threads);

}  // namespace packet
