#include "schedule/stream_order.h"

#include "core/direction_class.h"
#include "core/morton.h"
#include "schedule/radix_sort.h"

#include <array>
#include <numeric>
#include <utility>

namespace packet {

namespace {

// An item is a ray's place on the curve, some 40 cells along the scene's longest side, and below it
// its index.
constexpr int kIndexBits = 16, kOriginBits = 16;
static_assert(StreamOrder::kMostRays == std::size_t{1} << kIndexBits);

std::uint32_t index_of(std::uint32_t item) { return item & ((1u << kIndexBits) - 1); }

/// The point of the box that is nearest, along each axis; its lower corner for NaN.
glm::vec3 clamp_into(const Bounds3f& box, const glm::vec3& p) {
    glm::vec3 out;
    for (int a = 0; a < 3; ++a) {
        out[a] = p[a] > box.lower[a] ? std::min(p[a], box.upper[a]) : box.lower[a];
    }
    return out;
}

}  // namespace

std::span<const std::uint32_t> StreamOrder::sort(std::span<const Ray> rays, const Bounds3f& world) {
    PACKET_ASSERT(rays.size() <= kMostRays);
    items_.resize(rays.size()), scratch_.resize(rays.size()), classes_.resize(rays.size());
    const MortonGrid<std::uint32_t> grid(world);
    std::array<std::uint32_t, kDirectionClasses> place = {};
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Ray& ray = rays[i];
        const int direction = direction_class(ray.dir.x, ray.dir.y, ray.dir.z);
        const std::uint32_t origin = grid.code(clamp_into(world, ray.org));
        classes_[i] = static_cast<std::uint8_t>(direction);
        ++place[static_cast<std::size_t>(direction)];
        items_[i] = origin >> (kMortonBits<std::uint32_t> - kOriginBits) << kIndexBits |
                    static_cast<std::uint32_t>(i);
    }
    const std::span<std::uint32_t> by_origin =
        radix_sort(std::span(items_), std::span(scratch_), kOriginBits, Parallel(1),
                   [](std::uint32_t item) { return item >> kIndexBits; });
    ScratchVector<std::uint32_t>& out = by_origin.data() == items_.data() ? scratch_ : items_;
    std::exclusive_scan(place.begin(), place.end(), place.begin(), 0u);
    for (const std::uint32_t item : by_origin) {
        const std::uint32_t i = index_of(item);
        out[place[classes_[i]]++] = i;
    }
    return out;
}

std::unique_ptr<StreamOrder> StreamOrders::take() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<StreamOrder>();
    std::unique_ptr<StreamOrder> order = std::move(idle_.back());
    idle_.pop_back();
    return order;
}

void StreamOrders::give_back(std::unique_ptr<StreamOrder> order) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(order));
}

}  // namespace packet
