#include "schedule/auto_mode.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace packet {

namespace {

constexpr std::size_t kRunLength = 8;
constexpr std::size_t kMostRuns = 64;
// Neighbours within about 11 degrees: bounced rays never are, camera rays nearly always. Up to
// there tiles or packets are faster than streams (docs/benchmarking.md#steps-walks-and-coherence).
constexpr float kLeastCosine = 0.98f;
// Of the scene's diagonal. Rays that start farther apart meet different leaves.
constexpr float kFarthestOrigin = 0.05f;

bool start_together(std::span<const Ray> run, float diagonal) {
    return std::ranges::all_of(run, [&](const Ray& ray) {
        return glm::distance(ray.org, run[0].org) <= kFarthestOrigin * diagonal;
    });
}

bool go_together(std::span<const Ray> run) {
    const glm::vec3 dir = glm::normalize(run[0].dir);
    return std::ranges::all_of(run, [&](const Ray& ray) {
        return glm::dot(glm::normalize(ray.dir), dir) >= kLeastCosine;
    });
}

/// Whether test(run, the scene's diagonal) holds for half of a sample of runs of neighbours or
/// more. NaN anywhere makes comparisons false.
template <class Test>
bool mostly(std::span<const Ray> rays, const Bounds3f& world, Test test) {
    const float diagonal = glm::length(world.extent());
    const std::size_t runs = std::min(kMostRuns, rays.size() / kRunLength);
    const std::size_t stride = rays.size() / runs;
    std::size_t passed = 0;
    for (std::size_t i = 0; i < runs; ++i) {
        passed += test(rays.subspan(i * stride, kRunLength), diagonal);
    }
    return 2 * passed >= runs;
}

}  // namespace

Mode choose_mode(std::span<const Ray> rays, const Bounds3f& world) {
    if (rays.size() < kRunLength) return Mode::kSingle;
    const auto is_coherent = [](std::span<const Ray> run, float diagonal) {
        return go_together(run) && start_together(run, diagonal);
    };
    return mostly(rays, world, is_coherent) ? Mode::kTile : Mode::kSingle;
}

bool are_scattered(std::span<const Ray> rays, const Bounds3f& world) {
    return rays.size() >= kRunLength && !mostly(rays, world, start_together);
}

}  // namespace packet
