// Renders with a CUDA device.
#pragma once

#include "tracer.h"

#include <packet/cuda.h>

namespace packet::tools {

/// Rays are made and hits consumed by this thread.
class CudaTracer : public Tracer {
public:
    /// Throws as DeviceScene does. `mode` is for the camera's rays; others are judged by
    /// themselves.
    CudaTracer(const Scene& scene, cuda::DeviceMode mode) : device_(scene), mode_(mode) {}

    void tiles(int width, int height, const GenerateTile& generate,
               const ConsumeTile& consume) const override;
    void closest(std::span<const Ray> rays, std::span<Hit> hits, TraceStats* stats) const override;
    void any(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const override;

private:
    cuda::DeviceScene device_;
    cuda::DeviceMode mode_;
};

/// How the device walks for a mode of the CPU's: single rays by threads, any packets by warps.
[[nodiscard]] cuda::DeviceMode device_mode(Mode mode) noexcept;

}  // namespace packet::tools
