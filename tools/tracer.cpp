#include "tracer.h"

namespace packet::tools {

CpuTracer::CpuTracer(const Scene& scene, const TraceOptions& options)
    : scene_(scene), options_(options), options_in_tile_(options) {
    options_in_tile_.threads = 1;  // the tiles are spread over the threads already
}

void CpuTracer::tiles(int width, int height, const GenerateTile& generate,
                      const ConsumeTile& consume) const {
    trace_tiles(scene_, width, height, generate, consume, options_);
}

void CpuTracer::closest(std::span<const Ray> rays, std::span<Hit> hits, TraceStats* stats) const {
    TraceOptions options = options_in_tile_;
    options.stats = stats;
    trace_closest(scene_, rays, hits, options);
}

void CpuTracer::any(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
    trace_any(scene_, rays, occluded, options_in_tile_);
}

}  // namespace packet::tools
