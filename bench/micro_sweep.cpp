// Rays from as coherent as can be to not at all, in four ways: their directions spread, their
// origins do, an image's come in worse orders, or they have bounced more often.
#include "course.h"
#include "micro.h"

#include <fmt/core.h>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <camera.h>
#include <generate.h>
#include <random.h>
#include <ray_kinds.h>
#include <surface.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace packet::bench {
namespace {

constexpr tools::ImageSize kImageSize{256, 256};
// As many rays as a tile takes at once start alike, so that every mode finds what coherence is.
constexpr std::size_t kGroup = 128;

Scene make_committed_city() {
    Scene scene = make_scene(tools::generate("city", 200'000));
    BuildOptions options;
    options.treelet_bytes = kUsualTreeletBytes;
    scene.commit(options);
    return scene;
}

std::vector<Ray> camera_rays(const Scene& scene) {
    tools::CameraOptions camera;
    camera.size = kImageSize;
    return make_rays(tools::RayKind::kPrimary, scene, {camera, scene.bounds()}, 1);
}

/// Uniform over the directions within an angle of the axis, which has length 1.
glm::vec3 direction_in_cone(const glm::vec3& axis, float degrees, tools::Random& random) {
    const float cosine = glm::mix(std::cos(glm::radians(degrees)), 1.0f, random.uniform());
    const float sine = std::sqrt(std::max(0.0f, 1.0f - cosine * cosine));
    const glm::vec3 other = random.direction();
    const glm::vec3 aside = other - glm::dot(other, axis) * axis;
    const float length = glm::length(aside);
    return length > 0.0f ? cosine * axis + sine / length * aside : axis;
}

struct Spread {
    float degrees;  ///< between a ray and its group's axis, at most
    float percent;  ///< of the scene's diagonal, between a ray's origin and its group's, at most
};

/// Groups of rays that start anywhere in the scene's box and go anywhere.
std::vector<Ray> grouped_rays(const Scene& scene, Spread spread) {
    const Bounds3f box = scene.bounds();
    const float radius = 0.01f * spread.percent * tools::diagonal(box);
    std::vector<Ray> rays(kImageSize.pixel_count());
    glm::vec3 center, axis;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        tools::Random random(1, i);
        if (i % kGroup == 0) {
            center = glm::mix(box.lower, box.upper, random.point());
            axis = random.direction();
        }
        rays[i].org = center + radius * std::cbrt(random.uniform()) * random.direction();
        rays[i].dir = direction_in_cone(axis, spread.degrees, random);
    }
    return rays;
}

/// As many rays as before, from where they hit: if some miss, others go on more than once.
std::vector<Ray> bounce(const Scene& scene, const std::vector<Ray>& rays, std::uint64_t seed) {
    std::vector<Hit> hits(rays.size());
    trace_closest(scene, rays, hits);
    std::vector<std::size_t> seen;
    for (std::size_t i = 0; i < hits.size(); ++i) {
        if (hits[i].is_hit()) seen.push_back(i);
    }
    std::vector<Ray> out;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const std::size_t from = seen.at(i * seen.size() / rays.size());
        tools::Random random(seed, i);
        out.push_back(scatter(tools::surface_at(scene, rays[from], hits[from]),
                              std::numeric_limits<float>::infinity(), random));
    }
    return out;
}

std::vector<Ray> bounced_rays(const Scene& scene, int depth) {
    std::vector<Ray> rays = camera_rays(scene);
    for (int i = 1; i <= depth; ++i) rays = bounce(scene, rays, static_cast<std::uint64_t>(i));
    return rays;
}

enum class Order { kScanline, kSquares, kMorton };

/// Where a pixel comes. Squares are 4 x 4 pixels, row by row.
std::uint32_t place_of(std::uint32_t x, std::uint32_t y, Order order) {
    const auto width = static_cast<std::uint32_t>(kImageSize.width);
    if (order == Order::kScanline) return y * width + x;
    if (order == Order::kSquares) {
        return (y / 4 * (width / 4) + x / 4) * 16 + y % 4 * 4 + x % 4;
    }
    std::uint32_t code = 0;
    for (std::uint32_t bit = 0; bit < 16; ++bit) {
        code |= (x >> bit & 1) << 2 * bit | (y >> bit & 1) << (2 * bit + 1);
    }
    return code;
}

std::vector<Ray> ordered_rays(const Scene& scene, Order order) {
    const std::vector<Ray> rays = camera_rays(scene);
    const auto width = static_cast<std::uint32_t>(kImageSize.width);
    std::vector<Ray> out(rays.size());
    for (std::uint32_t i = 0; i < rays.size(); ++i) {
        out[place_of(i % width, i / width, order)] = rays[i];
    }
    return out;
}

/// SWEEP/VALUE/MODE for all modes, of the rays that make(scene) makes.
template <class Make>
void add_point(const Lazy<Scene>& scene, const std::string& name, Make make) {
    const Lazy<Course> course([scene, make] { return Course{scene.get(), make(scene.get()), 0}; });
    for (const ModeName& mode : mode_names()) {
        add_course(fmt::format("{}/{}", name, mode.name), course, mode.mode);
    }
}

}  // namespace

void add_sweep_benchmarks() {
    const Lazy<Scene> scene(make_committed_city);
    for (const float degrees : {0.0f, 0.5f, 1.0f, 2.0f, 5.0f, 10.0f, 20.0f, 45.0f, 90.0f, 180.0f}) {
        add_point(scene, fmt::format("angle/{}", degrees), [=](const Scene& in) {
            return grouped_rays(in, {degrees, 0.0f});
        });
    }
    for (const float percent : {0.01f, 0.03f, 0.1f, 0.3f, 1.0f, 3.0f, 10.0f, 30.0f, 100.0f}) {
        add_point(scene, fmt::format("origin/{}", percent), [=](const Scene& in) {
            return grouped_rays(in, {0.0f, percent});
        });
    }
    constexpr std::pair<Order, const char*> kOrders[] = {
        {Order::kScanline, "scanline"}, {Order::kSquares, "4x4"}, {Order::kMorton, "morton"}};
    for (const auto& [order, name] : kOrders) {
        add_point(scene, fmt::format("order/{}", name),
                  [order = order](const Scene& in) { return ordered_rays(in, order); });
    }
    for (int depth = 0; depth <= 8; ++depth) {
        add_point(scene, fmt::format("bounce/{}", depth),
                  [=](const Scene& in) { return bounced_rays(in, depth); });
    }
}

}  // namespace packet::bench
