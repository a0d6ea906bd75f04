// What the device's side of the library offers to benchmarks beside the public interface: rays and
// hits that are on the device already.
#pragma once

#include "kernels.h"
#include "scene_upload.h"

#include <packet/cuda.h>

namespace packet::cuda {

struct DeviceScene::Impl {
    explicit Impl(UploadedScene uploaded) : scene(std::move(uploaded)) {}

    UploadedScene scene;
};

/// Rays in device memory, and room for what they hit.
struct DeviceRays {
    explicit DeviceRays(std::uint32_t capacity)
        : rays(capacity), hits(capacity), occluded(capacity), next_slot(1), work(1) {}

    DeviceArray<Ray> rays;
    DeviceArray<Hit> hits;
    DeviceArray<std::uint8_t> occluded;
    DeviceArray<std::uint32_t> next_slot;
    DeviceArray<WorkCounts> work;
    DeviceArray<std::uint32_t> order;  ///< of kSorted
};

/// Traces the first `count` of the rays, later, in the stream; kSorted waits for its sort.
/// `mode` is not kAuto.
void trace_on_device(const DeviceScene::Impl& scene, DeviceRays& rays, std::uint32_t count,
                     const DeviceTraceOptions& options, Query query, cudaStream_t stream);

}  // namespace packet::cuda
