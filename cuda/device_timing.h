// How long a device traces, by its own clock.
#pragma once

#include <packet/cuda.h>

#include <span>
#include <vector>

namespace packet::cuda {

/// Seconds of `repeats` closest-hit traces of the rays, after one that is not counted: rays in the
/// device's memory to hits there, with kSorted the sort too. `mode` is not kAuto. All of them are 0
/// where the device is emulated, which has no clock. Throws as DeviceScene::trace_closest().
[[nodiscard]] std::vector<double> time_traces(const DeviceScene& scene, std::span<const Ray> rays,
                                              const DeviceTraceOptions& options, int repeats);

}  // namespace packet::cuda
