// Renders images: one pass over all tiles for each sample of the pixels.
#include "render.h"

#include "progress.h"
#include "surface.h"

#include <cstdint>
#include <vector>

namespace packet::tools {
namespace {

/// Calls function(pixel's number in the image, number in the tile, x, y) for a tile's pixels.
template <class Function>
void for_each_pixel(Tile tile, int width, Function function) {
    std::size_t in_tile = 0;
    for (int y = tile.y0; y < tile.y1; ++y) {
        const std::size_t line = static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
        for (int x = tile.x0; x < tile.x1; ++x) {
            function(line + static_cast<std::size_t>(x), in_tile++, x, y);
        }
    }
}

/// A pass in which each pixel gets one sample.
class Pass {
public:
    Pass(const Camera& camera, int sample, int samples)
        : camera_(camera), sample_(static_cast<std::uint64_t>(sample)), jitters_(samples > 1) {}

    void generate(Tile tile, std::span<Ray> rays) const {
        for_each_pixel(
            tile, camera_.size().width, [&](std::size_t pixel, std::size_t i, int x, int y) {
                Random random(2 * sample_, pixel);
                const float across = jitters_ ? random.uniform() : 0.5f;
                const float down = jitters_ ? random.uniform() : 0.5f;
                rays[i] = camera_.ray(static_cast<float>(x) + across, static_cast<float>(y) + down);
            });
    }

    /// Numbers for shading, other than those that moved the ray within the pixel.
    [[nodiscard]] std::vector<Random> shading_randoms(Tile tile) const {
        std::vector<Random> randoms;
        randoms.reserve(static_cast<std::size_t>(tile.pixel_count()));
        for_each_pixel(tile, camera_.size().width, [&](std::size_t pixel, std::size_t, int, int) {
            randoms.emplace_back(2 * sample_ + 1, pixel);
        });
        return randoms;
    }

private:
    const Camera& camera_;
    std::uint64_t sample_;
    bool jitters_;
};

}  // namespace

Image render(const Scene& scene, const Camera& camera, const Shading& shading, int samples,
             const Tracer& tracer) {
    const ImageSize size = camera.size();
    if (samples == 0) samples = shading.samples;
    const float weight = 1.0f / static_cast<float>(samples);
    const float distance = occlusion_distance(scene.bounds());

    std::vector<glm::vec3> image(size.pixel_count(), glm::vec3(0.0f));
    Progress progress("render", size.pixel_count() * static_cast<std::size_t>(samples));
    for (int sample = 0; sample < samples; ++sample) {
        const Pass pass(camera, sample, samples);
        const auto generate = [&](Tile tile, std::span<Ray> rays) { pass.generate(tile, rays); };
        const auto consume = [&](Tile tile, std::span<const Ray> rays, std::span<const Hit> hits) {
            std::vector<Random> randoms = pass.shading_randoms(tile);
            std::vector<glm::vec3> colors(rays.size());
            shading.shade({scene, distance, tracer, rays, hits, randoms}, colors);
            for_each_pixel(tile, size.width, [&](std::size_t pixel, std::size_t i, int, int) {
                image[pixel] += weight * colors[i];
            });
            progress.advance(rays.size());
        };
        tracer.tiles(size.width, size.height, generate, consume);
    }
    shading.develop(image);
    return to_image(size, image);
}

Image render(const Scene& scene, const Camera& camera, const Shading& shading, int samples,
             const TraceOptions& options) {
    return render(scene, camera, shading, samples, CpuTracer(scene, options));
}

}  // namespace packet::tools
