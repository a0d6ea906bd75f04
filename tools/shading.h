// Ways to turn rays and their hits into colors.
#pragma once

#include "random.h"
#include "tracer.h"

#include <packet/hit.h>
#include <packet/ray.h>
#include <packet/scene.h>

#include <glm/vec3.hpp>

#include <span>
#include <string_view>

namespace packet::tools {

/// What there is to shade: rays, their hits, and for each a stream of random numbers.
struct Sight {
    const Scene& scene;
    float occlusion_distance;
    const Tracer& tracer;  ///< for more rays
    std::span<const Ray> rays;
    std::span<const Hit> hits;
    std::span<Random> randoms;
};

/// Sets colors[i] to a sample of the color of ray i. Samples are then averaged.
using ShadeFunction = void (*)(const Sight& sight, std::span<glm::vec3> colors);
/// Maps the averages of a whole image to the colors shown, in [0, 1].
using DevelopFunction = void (*)(std::span<glm::vec3> colors);

struct Shading {
    std::string_view name;
    /// Samples a pixel if nothing else is said: enough for an image without much noise.
    int samples;
    ShadeFunction shade;
    DevelopFunction develop;
};

/// All shadings, in the order in which help lists them:
/// - normal: the triangle's normal as a color, turned to the camera
/// - depth: the distance, from white for the nearest hit of the image to dark for the farthest
/// - ao: ambient occlusion, how much of the surface's near surroundings is open
/// - heat: the nodes a single ray meets, by heat_color(), pale for the image's greatest number
/// - path: white clay under a bright sky, by path tracing
[[nodiscard]] std::span<const Shading> shadings() noexcept;

}  // namespace packet::tools
