#include "schedule/auto_mode.h"

#include <glm/geometric.hpp>

#include <algorithm>

namespace packet {

namespace {

using Run = std::span<const Ray>;

constexpr std::size_t kRunLength = 8;
constexpr std::size_t kMostRuns = 64;
constexpr std::size_t kTileRays = 128;  // as the kernels have
// Neighbours within about 11 degrees: bounced rays never are, camera rays nearly always.
constexpr float kLeastCosine = 0.98f;
// Of the scene's diagonal: farther apart rays start in different places, and rays that start in the
// scene hit something about so far away.
constexpr float kFarthestOrigin = 0.05f;
constexpr float kHitDistance = 0.12f;
// From ray to ray of the eight that are looked at of a tile, in the mean; of an image, whose tiles
// are blocks of pixels, from one pixel to the next in a row. Where tiles and streams are equally
// fast: docs/experiments.md#tiles-or-streams.
constexpr float kLeavesPerStep = 2.8f;
constexpr float kLeavesPerPixel = 0.7f;

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

/// How far apart, in the mean, rays `stride`, 2 stride ... of a run are from the one before where
/// they hit something.
float mean_step(Run run, std::size_t stride, const Bounds3f& world) {
    const float t = distance_to_hit(run[0].org, world);
    const auto at_hit = [&](const Ray& ray) { return ray.org + t * glm::normalize(ray.dir); };
    float sum = 0.0f;
    int steps = 0;
    for (std::size_t i = stride; i < run.size(); i += stride, ++steps) {
        sum += glm::distance(at_hit(run[i]), at_hit(run[i - stride]));
    }
    return sum / static_cast<float>(steps);
}

/// Whether test(run) holds for half of a sample of runs of `length` neighbours or more. NaN
/// anywhere makes comparisons false.
template <class Test>
bool mostly(std::span<const Ray> rays, std::size_t length, Test test) {
    const std::size_t runs = std::min(kMostRuns, rays.size() / length);
    const std::size_t stride = rays.size() / runs;
    std::size_t passed = 0;
    for (std::size_t i = 0; i < runs; ++i) passed += test(rays.subspan(i * stride, length));
    return 2 * passed >= runs;
}

}  // namespace

float distance_to_hit(const glm::vec3& org, const Bounds3f& world) {
    const glm::vec3 to_world = glm::max(glm::max(world.lower - org, org - world.upper), 0.0f);
    return glm::length(to_world) + kHitDistance * glm::length(world.extent());
}

bool are_coherent(std::span<const Ray> rays, const Bounds3f& world) {
    const float diagonal = glm::length(world.extent());
    return rays.size() >= kRunLength && mostly(rays, kRunLength, [&](Run run) {
               return go_together(run) && start_together(run, diagonal);
           });
}

bool share_leaves(std::span<const Ray> rays, bool in_rows, const Bounds3f& world,
                  float leaf_spacing) {
    const std::size_t stride = in_rows ? 1 : kTileRays / kRunLength;
    const float most = leaf_spacing * (in_rows ? kLeavesPerPixel : kLeavesPerStep);
    const std::size_t length = stride * kRunLength;
    return rays.size() < length ||
           mostly(rays, length, [&](Run run) { return mean_step(run, stride, world) <= most; });
}

bool are_scattered(std::span<const Ray> rays, const Bounds3f& world) {
    const float diagonal = glm::length(world.extent());
    return rays.size() >= kRunLength &&
           !mostly(rays, kRunLength, [&](Run run) { return start_together(run, diagonal); });
}

}  // namespace packet
