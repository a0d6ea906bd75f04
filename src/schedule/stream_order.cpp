#include "schedule/stream_order.h"

#include "core/direction_class.h"
#include "core/macros.h"
#include "core/morton.h"
#include "core/views.h"
#include "schedule/radix_sort.h"

#include <packet/bounds.h>

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace packet {

namespace {

// What is sorted: a ray's class, its place on the curve and its index, in one word. Finer cells
// than 16 along a side change nothing (docs/benchmarking.md#streams), and so two passes do.
constexpr int kIndexBits = 15, kCellBits = 4, kClassBits = 5;
constexpr int kLowBits = 9, kHighBits = 8;
constexpr int kHighShift = kIndexBits + kLowBits;
static_assert(StreamOrder::kMostRays == std::size_t{1} << kIndexBits);
static_assert(kDirectionClasses <= 1 << kClassBits);

constexpr int kKeyBits = 3 * kCellBits + kClassBits;
static_assert(kLowBits + kHighBits == kKeyBits);

constexpr std::uint32_t low_digit(std::uint32_t item) noexcept {
    return item >> kIndexBits & ((1u << kLowBits) - 1);
}
constexpr std::uint32_t high_digit(std::uint32_t item) noexcept { return item >> kHighShift; }

/// Cells over where a sample of the rays starts, which may be a small part of the scene. Rays that
/// start elsewhere belong to the nearest cell, along each axis.
class OriginCells {
public:
    explicit OriginCells(std::span<const Ray> rays) {
        Bounds3f box;
        for (std::size_t i = 0; i < rays.size(); i += kStride) {
            const glm::vec3& org = rays[i].org;
            // false for NaN and infinity, which would leave one cell for all others
            if (glm::all(glm::lessThan(glm::abs(org), glm::vec3(kMaxCoordinate)))) box.extend(org);
        }
        if (box.empty()) return;
        const glm::vec3 extent = box.extent();
        const float scale =
            static_cast<float>(kCells) / std::max(std::max(extent.x, extent.y), extent.z);
        lower_ = box.lower;
        // No extent, or one so small that floats do not resolve it: one cell holds everything.
        scale_ = std::isfinite(scale) ? scale : 0.0f;
    }
    /// The place on a Morton curve.
    [[nodiscard]] std::uint32_t code(const glm::vec3& org) const noexcept {
        return kSpread[cell(org.x, 0)] << 2 | kSpread[cell(org.y, 1)] << 1 |
               kSpread[cell(org.z, 2)];
    }

private:
    static constexpr int kCells = 1 << kCellBits;
    static constexpr std::size_t kStride = 16;
    static constexpr auto kSpread = [] {
        std::array<std::uint32_t, kCells> out = {};
        for (std::uint32_t i = 0; i < kCells; ++i) out[i] = spread_10_bits(i);
        return out;
    }();

    /// 0 for NaN.
    [[nodiscard]] std::size_t cell(float x, int axis) const noexcept {
        const float place = (x - lower_[axis]) * scale_;
        const float inside = place > 0.0f ? place : 0.0f;
        return static_cast<std::size_t>(
            static_cast<int>(std::min(inside, static_cast<float>(kCells - 1))));
    }

    glm::vec3 lower_{0.0f};
    float scale_ = 0.0f;
};

/// By what rays are sorted: kKeyBits.
std::uint32_t key_of(const Ray& ray, const OriginCells& cells) noexcept {
    const int direction = direction_class(ray.dir.x, ray.dir.y, ray.dir.z);
    return static_cast<std::uint32_t>(direction) << 3 * kCellBits | cells.code(ray.org);
}

/// Turns counts into the place of the first item of each digit.
template <std::size_t kCount>
void scan(std::array<std::uint32_t, kCount>& counts) noexcept {
    std::uint32_t place = 0;
    for (std::uint32_t& count : counts) place += std::exchange(count, place);
}

}  // namespace

std::span<const std::uint32_t> StreamOrder::sort(std::span<const Ray> rays) {
    PACKET_ASSERT(rays.size() <= kMostRays);
    items_.resize(rays.size()), scratch_.resize(rays.size());
    const OriginCells cells(rays);
    std::array<std::uint32_t, 1u << kLowBits> low = {};
    std::array<std::uint32_t, 1u << kHighBits> high = {};
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const std::uint32_t item =
            key_of(rays[i], cells) << kIndexBits | static_cast<std::uint32_t>(i);
        ++low[low_digit(item)], ++high[high_digit(item)];
        items_[i] = item;
    }
    scan(low), scan(high);
    for (const std::uint32_t item : items_) scratch_[low[low_digit(item)]++] = item;
    for (const std::uint32_t item : scratch_) {
        items_[high[high_digit(item)]++] = item & ((1u << kIndexBits) - 1);
    }
    return items_;
}

void sort_many(std::span<const Ray> rays, std::span<std::uint32_t> out, std::uint32_t first,
               const Parallel& parallel) {
    PACKET_ASSERT(out.size() == rays.size());
    constexpr std::size_t kGrain = 65536;  // 100 us or more
    struct Item {
        std::uint32_t key, index;
    };
    const OriginCells cells(rays);
    ScratchVector<Item> items(rays.size()), scratch(rays.size());
    parallel.for_pieces(rays.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            items[i] = {key_of(rays[i], cells), first + static_cast<std::uint32_t>(i)};
        }
    });
    const std::span<const Item> sorted =
        radix_sort(std::span<Item>(items), std::span<Item>(scratch), kKeyBits, parallel,
                   [](const Item& item) { return item.key; });
    parallel.for_pieces(rays.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) out[i] = sorted[i].index;
    });
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
