#include "schedule/auto_mode.h"

#include <glm/geometric.hpp>

#include <algorithm>

namespace packet {

namespace {

using Run = std::span<const Ray>;

constexpr std::size_t kRunLength = 8;
constexpr std::size_t kMostRuns = 64;
// Neighbours within about 11 degrees: bounced rays never are, camera rays nearly always.
constexpr float kLeastCosine = 0.98f;
// Of the scene's diagonal: farther apart rays start in different places, and rays that start in the
// scene hit something about so far away. Measured: docs/experiments.md#tiles-or-streams.
constexpr float kFarthestOrigin = 0.05f;
constexpr float kHitDistance = 0.15f;

bool start_together(Run run, float diagonal) {
    return std::ranges::all_of(run, [&](const Ray& ray) {
        return glm::distance(ray.org, run[0].org) <= kFarthestOrigin * diagonal;
    });
}

bool go_together(Run run) {
    const glm::vec3 dir = glm::normalize(run[0].dir);
    return std::ranges::all_of(run, [&](const Ray& ray) {
        return glm::dot(glm::normalize(ray.dir), dir) >= kLeastCosine;
    });
}

bool hit_together(Run run, const Bounds3f& world, float diagonal, float farthest) {
    const glm::vec3 org = run[0].org, dir = glm::normalize(run[0].dir);
    const glm::vec3 to_world = glm::max(glm::max(world.lower - org, org - world.upper), 0.0f);
    const float t = glm::length(to_world) + kHitDistance * diagonal;
    return std::ranges::all_of(run, [&](const Ray& ray) {
        const float by_angle = t * glm::distance(glm::normalize(ray.dir), dir);
        return glm::distance(ray.org, org) + by_angle <= farthest;
    });
}

/// Whether test(run) holds for half of a sample of runs of neighbours or more. NaN anywhere makes
/// comparisons false.
template <class Test>
bool mostly(std::span<const Ray> rays, Test test) {
    const std::size_t runs = std::min(kMostRuns, rays.size() / kRunLength);
    const std::size_t stride = rays.size() / runs;
    std::size_t passed = 0;
    for (std::size_t i = 0; i < runs; ++i) passed += test(rays.subspan(i * stride, kRunLength));
    return 2 * passed >= runs;
}

}  // namespace

bool are_coherent(std::span<const Ray> rays, const Bounds3f& world, float farthest) {
    const float diagonal = glm::length(world.extent());
    return rays.size() >= kRunLength && mostly(rays, [&](Run run) {
               return go_together(run) && start_together(run, diagonal) &&
                      hit_together(run, world, diagonal, farthest);
           });
}

bool are_scattered(std::span<const Ray> rays, const Bounds3f& world) {
    const float diagonal = glm::length(world.extent());
    return rays.size() >= kRunLength &&
           !mostly(rays, [&](Run run) { return start_together(run, diagonal); });
}

}  // namespace packet
