// Sets of rays as renderers trace them.
#include "ray_kinds.h"

#include "random.h"
#include "surface.h"

#include <packet/error.h>

#include <glm/common.hpp>

#include <limits>
#include <span>
#include <utility>

namespace packet::tools {
namespace {

std::vector<Ray> primary_rays(const Camera& camera) {
    std::vector<Ray> rays;
    rays.reserve(camera.size().pixel_count());
    for (int y = 0; y < camera.size().height; ++y) {
        for (int x = 0; x < camera.size().width; ++x) {
            rays.push_back(camera.ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
        }
    }
    return rays;
}

std::vector<Ray> random_rays(const Bounds3f& bounds, std::size_t count, std::uint64_t seed) {
    if (bounds.empty()) throw Error(ErrorCode::kBadValue, "the scene has no triangles");
    std::vector<Ray> rays(count);
    for (std::size_t i = 0; i < count; ++i) {
        Random random(seed, i);
        rays[i].org = glm::mix(bounds.lower, bounds.upper, random.point());
        rays[i].dir = random.direction();
    }
    return rays;
}

/// What the camera sees: primary rays and their hits, all of which hit something.
struct View {
    std::vector<Ray> rays;
    std::vector<Hit> hits;
};

/// The ray through a random point of a pixel.
Ray jittered_ray(const Camera& camera, std::uint32_t pixel, Random random) {
    const auto width = static_cast<std::uint32_t>(camera.size().width);
    const std::uint32_t column = pixel % width, row = pixel / width;
    const float x = static_cast<float>(column) + random.uniform();
    const float y = static_cast<float>(row) + random.uniform();
    return camera.ray(x, y);
}

/// Moves what hits to the front and returns the pixels it belongs to.
std::vector<std::uint32_t> compact(View& view) {
    std::vector<std::uint32_t> pixels;
    for (std::size_t i = 0; i < view.hits.size(); ++i) {
        if (!view.hits[i].is_hit()) continue;
        view.rays[pixels.size()] = view.rays[i];
        view.hits[pixels.size()] = view.hits[i];
        pixels.push_back(static_cast<std::uint32_t>(i));
    }
    return pixels;
}

/// One hit for each pixel of the image. Those that lack are made up for by more of the pixels that
/// see something.
View look(const Scene& scene, const Camera& camera, std::uint64_t seed, TraceOptions options) {
    View view{primary_rays(camera), std::vector<Hit>(camera.size().pixel_count())};
    options.width = camera.size().width;
    trace_closest(scene, view.rays, view.hits, options);
    const std::vector<std::uint32_t> pixels = compact(view);
    if (pixels.empty()) throw Error(ErrorCode::kBadValue, "the camera sees nothing of the scene");

    const std::size_t seen = pixels.size();
    for (std::size_t i = seen; i < view.rays.size(); ++i) {
        view.rays[i] = jittered_ray(camera, pixels[i % seen], Random(seed, i));
    }
    options.width = 0;
    trace_closest(scene, std::span(view.rays).subspan(seen), std::span(view.hits).subspan(seen),
                  options);
    for (std::size_t i = seen; i < view.rays.size(); ++i) {
        if (view.hits[i].is_hit())
            continue;  // else the point is off an edge: take the centre again
        view.rays[i] = view.rays[i % seen];
        view.hits[i] = view.hits[i % seen];
    }
    return view;
}

/// Inside with a camera that is inside, as in a room; else aside of the scene and above it.
glm::vec3 light_position(const Bounds3f& bounds, const glm::vec3& eye) {
    const bool inside = bounds.contains(Bounds3f{eye, eye});
    const glm::vec3 place = inside ? glm::vec3(0.5f, 0.8f, 0.5f) : glm::vec3(0.4f, 1.8f, 1.2f);
    return bounds.lower + place * bounds.extent();
}

Ray shadow_ray(const Surface& surface, const glm::vec3& light) {
    constexpr float kBeforeLight = 0.999f;  // a lamp's own triangles cast no shadow
    return {surface.origin, 0.0f, light - surface.origin, kBeforeLight};
}

}  // namespace

std::vector<Ray> make_rays(RayKind kind, const Scene& scene, const Camera& camera,
                           std::uint64_t seed, const TraceOptions& options) {
    if (kind == RayKind::kPrimary) return primary_rays(camera);
    const Bounds3f bounds = scene.bounds();
    if (kind == RayKind::kRandom) return random_rays(bounds, camera.size().pixel_count(), seed);

    constexpr std::uint64_t kOtherSeed =
        0x5851F42D4C957F2Du;  // not the numbers that moved the pixels
    View view = look(scene, camera, seed ^ kOtherSeed, options);
    const glm::vec3 light = light_position(bounds, camera.eye());
    const float length =
        kind == RayKind::kAo ? occlusion_distance(bounds) : std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < view.rays.size(); ++i) {
        const Surface surface = surface_at(scene, view.rays[i], view.hits[i]);
        Random random(seed, i);
        view.rays[i] = kind == RayKind::kShadow ? shadow_ray(surface, light)
                                                : scatter(surface, length, random);
    }
    return std::move(view.rays);
}

}  // namespace packet::tools
