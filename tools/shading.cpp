// Ways to turn rays and their hits into colors.
#include "shading.h"

#include "image.h"
#include "path_tracer.h"
#include "surface.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace packet::tools {
namespace {

constexpr glm::vec3 kBackground(0.1f);  // no surface's color, in the shadings that use it

void shade_normal(const Sight& sight, std::span<glm::vec3> colors) {
    for (std::size_t i = 0; i < colors.size(); ++i) {
        const Hit& hit = sight.hits[i];
        colors[i] = kBackground;
        if (!hit.is_hit()) continue;
        colors[i] = 0.5f * surface_at(sight.scene, sight.rays[i], hit).normal + 0.5f;
    }
}

void shade_depth(const Sight& sight, std::span<glm::vec3> colors) {
    for (std::size_t i = 0; i < colors.size(); ++i) colors[i] = glm::vec3(sight.hits[i].t);
}

/// From distances, infinite where nothing is, to greys.
void develop_depth(std::span<glm::vec3> colors) {
    float nearest = std::numeric_limits<float>::infinity(), farthest = 0.0f;
    for (const glm::vec3& color : colors) {
        if (!std::isfinite(color.x)) continue;
        nearest = std::min(nearest, color.x);
        farthest = std::max(farthest, color.x);
    }
    constexpr float kDarkest = 0.15f;  // apart from the background's black
    const float range = std::max(farthest - nearest, std::numeric_limits<float>::min());
    for (glm::vec3& color : colors) {
        const float grey = 1.0f - (1.0f - kDarkest) * (color.x - nearest) / range;
        color = glm::vec3(std::isfinite(color.x) ? grey : 0.0f);
    }
}

void shade_occlusion(const Sight& sight, std::span<glm::vec3> colors) {
    std::vector<Ray> rays;
    std::vector<std::size_t> owners;
    for (std::size_t i = 0; i < colors.size(); ++i) {
        colors[i] = kBackground;
        if (!sight.hits[i].is_hit()) continue;
        const Surface surface = surface_at(sight.scene, sight.rays[i], sight.hits[i]);
        rays.push_back(scatter(surface, sight.occlusion_distance, sight.randoms[i]));
        owners.push_back(i);
    }
    std::vector<std::uint8_t> occluded(rays.size());
    sight.tracer.any(rays, occluded);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        colors[owners[i]] = glm::vec3(occluded[i] != 0 ? 0.0f : 1.0f);
    }
}

void shade_heat(const Sight& sight, std::span<glm::vec3> colors) {
    for (std::size_t i = 0; i < colors.size(); ++i) {
        TraceStats stats;
        Hit hit;
        sight.tracer.closest(sight.rays.subspan(i, 1), std::span(&hit, 1), &stats);
        colors[i] = glm::vec3(static_cast<float>(stats.nodes));
    }
}

/// From numbers of nodes to colors.
void develop_heat(std::span<glm::vec3> colors) {
    float most = 1.0f;
    for (const glm::vec3& color : colors) most = std::max(most, color.x);
    for (glm::vec3& color : colors) color = heat_color(color.x / most);
}

void develop_light(std::span<glm::vec3> colors) {
    for (glm::vec3& color : colors) color = encode_srgb(color);
}

void develop_nothing(std::span<glm::vec3> /*colors*/) {}

constexpr Shading kShadings[] = {{"normal", 4, shade_normal, develop_nothing},
                                 {"depth", 1, shade_depth, develop_depth},
                                 {"ao", 32, shade_occlusion, develop_nothing},
                                 {"heat", 1, shade_heat, develop_heat},
                                 {"path", 32, shade_path, develop_light}};

}  // namespace

std::span<const Shading> shadings() noexcept { return kShadings; }

}  // namespace packet::tools
