#include "cuda_tracer.h"

#include <algorithm>
#include <vector>

namespace packet::tools {

// Pixels of a tile: enough to fill a device, 60 MB with rays and hits.
static constexpr int kTilePixels = 1 << 20;

cuda::DeviceMode device_mode(Mode mode) noexcept {
    switch (mode) {
        case Mode::kAuto: return cuda::DeviceMode::kAuto;
        case Mode::kSingle: return cuda::DeviceMode::kThread;
        case Mode::kTreelet:
        case Mode::kStream: return cuda::DeviceMode::kSorted;
        case Mode::kPacket8:
        case Mode::kPacket16:
        case Mode::kTile: break;
    }
    return cuda::DeviceMode::kWarp;
}

void CudaTracer::tiles(int width, int height, const GenerateTile& generate,
                       const ConsumeTile& consume) const {
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    const int lines = std::max(1, kTilePixels / std::max(1, width));
    for (int y = 0; y < height; y += lines) {
        const Tile tile{0, y, width, std::min(height, y + lines)};
        rays.resize(static_cast<std::size_t>(tile.pixel_count()));
        hits.resize(rays.size());
        generate(tile, rays);
        device_.trace_closest(rays, hits, {mode_, width, nullptr});
        consume(tile, rays, hits);
    }
}

void CudaTracer::closest(std::span<const Ray> rays, std::span<Hit> hits, TraceStats* stats) const {
    device_.trace_closest(rays, hits, {cuda::DeviceMode::kAuto, 0, stats});
}

void CudaTracer::any(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
    device_.trace_any(rays, occluded, {});
}

}  // namespace packet::tools
