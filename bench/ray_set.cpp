#include "ray_set.h"

#include <algorithm>
#include <numeric>

namespace packet::bench {
namespace {

constexpr std::uint64_t kSeed = 1;

Query usual_query(tools::RayKind kind) {
    const bool asks_for_light = kind == tools::RayKind::kShadow || kind == tools::RayKind::kAo;
    return asks_for_light ? Query::kAny : Query::kClosest;
}

// The pixels of an image by blocks of 4 x 4, cut off at the right and lower border. 8 pixels in a
// row of a whole block's are then 4 x 2, and 16 the block.
std::vector<std::uint32_t> order_of_blocks(std::uint32_t width, std::uint32_t height) {
    constexpr std::uint32_t kSide = 4;
    std::vector<std::uint32_t> order;
    order.reserve(std::size_t{width} * height);
    for (std::uint32_t y0 = 0; y0 < height; y0 += kSide) {
        for (std::uint32_t x0 = 0; x0 < width; x0 += kSide) {
            for (std::uint32_t y = y0; y < std::min(y0 + kSide, height); ++y) {
                for (std::uint32_t x = x0; x < std::min(x0 + kSide, width); ++x) {
                    order.push_back(y * width + x);
                }
            }
        }
    }
    return order;
}

std::vector<std::uint32_t> order_as_is(std::size_t count) {
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    return order;
}

}  // namespace

std::string_view to_string(Query query) noexcept {
    return query == Query::kClosest ? "closest" : "any";
}

RaySet make_ray_set(tools::RayKind kind, const Scene& scene, const tools::Camera& camera) {
    RaySet set;
    set.name = tools::kRayKinds[static_cast<std::size_t>(kind)].name;
    set.query = usual_query(kind);
    set.rays = tools::make_rays(kind, scene, camera, kSeed);
    if (kind == tools::RayKind::kPrimary) set.width = camera.size().width;
    set.block_order = set.width == 0
                          ? order_as_is(set.rays.size())
                          : order_of_blocks(static_cast<std::uint32_t>(set.width),
                                            static_cast<std::uint32_t>(camera.size().height));
    set.block_rays.reserve(set.rays.size());
    for (const std::uint32_t i : set.block_order) set.block_rays.push_back(set.rays[i]);
    return set;
}

}  // namespace packet::bench
