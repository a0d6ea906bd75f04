#include "schedule/parallel.h"

#include <packet/error.h>
#include <packet/trace.h>

#include <algorithm>
#include <mutex>
#include <string>
#include <vector>

namespace packet {

// A tile's rays and hits stay in the L2 cache: 1024 of them take 56 KB.
static constexpr int kTileEdge = 32;

static Tile tile_at(int index, int tiles_x, int width, int height) {
    const int x0 = index % tiles_x * kTileEdge, y0 = index / tiles_x * kTileEdge;
    return {x0, y0, std::min(x0 + kTileEdge, width), std::min(y0 + kTileEdge, height)};
}

void trace_tiles(const Scene& scene, int width, int height, const GenerateTile& generate,
                 const ConsumeTile& consume, const TraceOptions& options) {
    if (width <= 0 || height <= 0) {
        throw Error(ErrorCode::kBadValue, "an image of " + std::to_string(width) + " x " +
                                              std::to_string(height) + " has no pixels");
    }
    const Parallel parallel(options.threads);
    const int tiles_x = (width + kTileEdge - 1) / kTileEdge;
    const int tiles_y = (height + kTileEdge - 1) / kTileEdge;
    const auto tile_count = static_cast<std::size_t>(tiles_x) * static_cast<std::size_t>(tiles_y);
    std::mutex stats_mutex;
    parallel.run([&] {
        parallel.for_pieces(tile_count, 1, [&](std::size_t index, std::size_t) {
            const Tile tile = tile_at(static_cast<int>(index), tiles_x, width, height);
            std::vector<Ray> rays(static_cast<std::size_t>(tile.pixel_count()));
            std::vector<Hit> hits(rays.size());
            TraceOptions tile_options = options;
            TraceStats tile_stats;
            if (options.stats != nullptr) tile_options.stats = &tile_stats;
            tile_options.threads = 1;
            tile_options.width = tile.x1 - tile.x0;
            generate(tile, rays);
            trace_closest(scene, rays, hits, tile_options);
            consume(tile, rays, hits);
            if (options.stats != nullptr) {
                const std::lock_guard lock(stats_mutex);
                *options.stats += tile_stats;
            }
        });
    });
}

}  // namespace packet
