#include "schedule/auto_mode.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace packet {

namespace {

constexpr std::size_t kRunLength = 8;
constexpr std::size_t kMostRuns = 64;
// Neighbours within about 18 degrees: bounced rays never are, camera rays always.
constexpr float kLeastCosine = 0.95f;
// Of the scene's diagonal. Rays that start farther apart meet different leaves.
constexpr float kFarthestOrigin = 0.05f;

/// NaN anywhere makes a comparison false and the run incoherent.
bool is_coherent(std::span<const Ray> run, float diagonal) {
    const glm::vec3 dir = glm::normalize(run[0].dir);
    return std::ranges::all_of(run, [&](const Ray& ray) {
        return glm::dot(glm::normalize(ray.dir), dir) >= kLeastCosine &&
               glm::distance(ray.org, run[0].org) <= kFarthestOrigin * diagonal;
    });
}

}  // namespace

Mode choose_mode(std::span<const Ray> rays, const Bounds3f& world) {
    if (rays.size() < kRunLength) return Mode::kSingle;
    const float diagonal = glm::length(world.extent());
    const std::size_t runs = std::min(kMostRuns, rays.size() / kRunLength);
    const std::size_t stride = rays.size() / runs;
    std::size_t coherent = 0;
    for (std::size_t i = 0; i < runs; ++i) {
        coherent += is_coherent(rays.subspan(i * stride, kRunLength), diagonal);
    }
    return 2 * coherent >= runs ? Mode::kTile : Mode::kSingle;
}

}  // namespace packet
