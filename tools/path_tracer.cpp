// A small path tracer, bounce by bounce for all rays of a tile, so that they are traced as packets.
//
// Kajiya. The rendering equation. SIGGRAPH 1986.
#include "path_tracer.h"

#include "surface.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
#include <vector>

namespace packet::tools {
namespace {

constexpr float kUnbounded = std::numeric_limits<float>::infinity();
constexpr float kAlbedo = 0.7f;
constexpr int kMaxBounces = 6;  // what comes later is below 0.7^6 = 0.12 of the sky's light

/// Light from the sky: blue above, white at the horizon, dim below, so that undersides show, and
/// bright about a hazy sun, so that sides differ. A small sun would need many more samples.
glm::vec3 sky(const glm::vec3& dir) {
    const glm::vec3 d = glm::normalize(dir);
    const glm::vec3 pole = d.y > 0.0f ? glm::vec3(0.25f, 0.4f, 0.7f) : glm::vec3(0.2f);
    const glm::vec3 air = glm::mix(glm::vec3(0.8f), pole, std::sqrt(std::abs(d.y)));
    constexpr glm::vec3 kSun(0.8f, 0.52f, 0.3f);  // where it is, of length 1
    const float nearness = std::pow(glm::max(glm::dot(d, kSun), 0.0f), 8.0f);
    return air + nearness * glm::vec3(2.4f, 2.0f, 1.4f);
}

/// A path on its way, with the ray of `Sight` it belongs to.
struct Path {
    std::size_t owner;
    Ray ray;
    Hit hit;
};

/// The paths that hit something, sent on; the others bring their light home.
std::vector<Path> bounce(const Sight& sight, const std::vector<Path>& paths, float throughput,
                         std::span<glm::vec3> colors) {
    std::vector<Path> survivors;
    survivors.reserve(paths.size());
    for (const Path& path : paths) {
        if (!path.hit.is_hit()) {
            colors[path.owner] = throughput * sky(path.ray.dir);
            continue;
        }
        const Surface surface = surface_at(sight.scene, path.ray, path.hit);
        const Ray next = scatter(surface, kUnbounded, sight.randoms[path.owner]);
        survivors.push_back({path.owner, next, Hit{}});
    }
    return survivors;
}

void trace(const Sight& sight, std::vector<Path>& paths) {
    std::vector<Ray> rays;
    rays.reserve(paths.size());
    for (const Path& path : paths) rays.push_back(path.ray);
    std::vector<Hit> hits(rays.size());
    sight.tracer.closest(rays, hits);
    for (std::size_t i = 0; i < paths.size(); ++i) paths[i].hit = hits[i];
}

}  // namespace

void shade_path(const Sight& sight, std::span<glm::vec3> colors) {
    std::vector<Path> paths;
    paths.reserve(colors.size());
    for (std::size_t i = 0; i < colors.size(); ++i) {
        colors[i] = glm::vec3(0.0f);
        paths.push_back({i, sight.rays[i], sight.hits[i]});
    }
    float throughput = 1.0f;
    for (int i = 0; i < kMaxBounces && !paths.empty(); ++i) {
        paths = bounce(sight, paths, throughput, colors);
        trace(sight, paths);
        throughput *= kAlbedo;
    }
    bounce(sight, paths, throughput, colors);
}

}  // namespace packet::tools
