// Rays to trace, with all that a tracer may know of them.
#pragma once

#include <packet/ray.h>
#include <packet/scene.h>

#include <camera.h>
#include <ray_kinds.h>

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace packet::bench {

enum class Query : std::uint8_t { kClosest, kAny };
[[nodiscard]] std::string_view to_string(Query query) noexcept;

struct RaySet {
    std::string_view name;
    /// What renderers ask of rays of this kind: any hit of those that only ask for light.
    Query query = Query::kClosest;
    std::vector<Ray> rays;
    /// Of the image whose scanlines the rays are in the order of, 0 if they are not.
    int width = 0;

    /// The same rays in an order that suits consecutive packets: an image's in blocks of 4 x 4
    /// pixels. block_rays[i] is rays[block_order[i]].
    std::vector<Ray> block_rays;
    std::vector<std::uint32_t> block_order;
};

/// Throws as tools::make_rays().
[[nodiscard]] RaySet make_ray_set(tools::RayKind kind, const Scene& scene,
                                  const tools::Camera& camera);

}  // namespace packet::bench
