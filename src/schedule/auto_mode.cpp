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

/// How far apart, in the mean, eight rays are from the one before where they hit something. Ray i
/// is ray_at(i).
template <class RayAt>
float mean_step(const Bounds3f& world, RayAt ray_at) {
    const float t = distance_to_hit(ray_at(0).org, world);
    const auto at_hit = [&](const Ray& ray) { return ray.org + t * glm::normalize(ray.dir); };
    float sum = 0.0f;
    for (std::size_t i = 1; i < kRunLength; ++i) {
        sum += glm::distance(at_hit(ray_at(i)), at_hit(ray_at(i - 1)));
    }
    return sum / static_cast<float>(kRunLength - 1);
}

/// Whether test(first) holds for half of a sample of runs of `length` of `count` rays or more,
/// which start at `first`. NaN anywhere makes comparisons false.
template <class Test>
bool mostly(std::size_t count, std::size_t length, Test test) {
    const std::size_t runs = std::min(kMostRuns, count / length);
    const std::size_t stride = count / runs;
    std::size_t passed = 0;
    for (std::size_t i = 0; i < runs; ++i) passed += test(i * stride);
    return 2 * passed >= runs;
}

/// Of pixels in scanline order, the first of a run of which `pixel` is one, in one line if it has
/// so many.
std::size_t start_in_line(std::size_t pixel, std::size_t width) {
    const std::size_t x = pixel % width;
    return width < kRunLength ? pixel : pixel - x + std::min(x, width - kRunLength);
}

}  // namespace

float distance_to_hit(const glm::vec3& org, const Bounds3f& world) {
    const glm::vec3 to_world = glm::max(glm::max(world.lower - org, org - world.upper), 0.0f);
    return glm::length(to_world) + kHitDistance * glm::length(world.extent());
}

bool are_coherent(std::span<const Ray> rays, const Bounds3f& world) {
    const float diagonal = glm::length(world.extent());
    return rays.size() >= kRunLength && mostly(rays.size(), kRunLength, [&](std::size_t first) {
               const Run run = rays.subspan(first, kRunLength);
               return go_together(run) && start_together(run, diagonal);
           });
}

bool share_leaves(std::span<const Ray> rays, const PixelLayout& image, const Bounds3f& world,
                  float leaf_spacing) {
    if (image.is_image()) {
        return rays.size() < kRunLength || mostly(rays.size(), kRunLength, [&](std::size_t pixel) {
                   const std::size_t first = start_in_line(pixel, image.width);
                   return mean_step(world, [&](std::size_t i) -> const Ray& {
                              const std::size_t y = (first + i) / image.width;
                              return rays[image.column((first + i) % image.width) + image.row(y)];
                          }) <= kLeavesPerPixel * leaf_spacing;
               });
    }
    return rays.size() < kTileRays || mostly(rays.size(), kTileRays, [&](std::size_t first) {
               return mean_step(world, [&](std::size_t i) -> const Ray& {
                          return rays[first + i * (kTileRays / kRunLength)];
                      }) <= kLeavesPerStep * leaf_spacing;
           });
}

bool are_scattered(std::span<const Ray> rays, const Bounds3f& world) {
    const float diagonal = glm::length(world.extent());
    return rays.size() >= kRunLength && !mostly(rays.size(), kRunLength, [&](std::size_t first) {
               return start_together(rays.subspan(first, kRunLength), diagonal);
           });
}

}  // namespace packet
