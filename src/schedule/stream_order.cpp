#include "schedule/stream_order.h"

#include "core/direction_class.h"
#include "core/macros.h"
#include "core/views.h"
#include "schedule/radix_sort.h"

#include <packet/bounds.h>

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

namespace packet {

namespace {

// What is sorted: a ray's class, its place on the curve and its index, in one word. Finer cells
// than 16 along a side change nothing (docs/benchmarking.md#streams), and so two passes do.
constexpr int kIndexBits = 14, kCellBits = 4, kClassBits = 5;
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

/// Four rays at once, in registers that every CPU has: one by one their keys took two thirds of the
/// time of sorting.
constexpr std::size_t kTogether = 4;
using Floats [[gnu::vector_size(16)]] = float;
using Ints [[gnu::vector_size(16)]] = std::int32_t;

Ints bits_of(Floats a) noexcept { return reinterpret_cast<Ints>(a); }

/// Components, each of all four rays.
struct FourRays {
    Floats org[3], dir[3];

    explicit FourRays(const Ray* const (&rays)[kTogether]) noexcept {
        static_assert(sizeof(Ray) == 2 * sizeof(Floats));
        Floats rows[2][kTogether];
        for (std::size_t i = 0; i < kTogether; ++i)
            std::memcpy(&rows[0][i], rays[i], sizeof(Floats));
        for (std::size_t i = 0; i < kTogether; ++i) {
            std::memcpy(&rows[1][i], reinterpret_cast<const char*>(rays[i]) + sizeof(Floats),
                        sizeof(Floats));
        }
        transpose3(rows[0], org), transpose3(rows[1], dir);
    }

private:
    /// The first three columns.
    static void transpose3(const Floats (&rows)[kTogether], Floats (&out)[3]) noexcept {
        const Floats xy01 = __builtin_shufflevector(rows[0], rows[1], 0, 4, 1, 5);
        const Floats xy23 = __builtin_shufflevector(rows[2], rows[3], 0, 4, 1, 5);
        const Floats z01 = __builtin_shufflevector(rows[0], rows[1], 2, 6, 3, 7);
        const Floats z23 = __builtin_shufflevector(rows[2], rows[3], 2, 6, 3, 7);
        out[0] = __builtin_shufflevector(xy01, xy23, 0, 1, 4, 5);
        out[1] = __builtin_shufflevector(xy01, xy23, 2, 3, 6, 7);
        out[2] = __builtin_shufflevector(z01, z23, 0, 1, 4, 5);
    }
};

/// direction_class() of each.
Ints direction_classes(const Floats (&dir)[3]) noexcept {
    const auto negative = [](Floats a) { return bits_of(a) >> 31; };  // -1 or 0
    const auto size = [](Floats a) { return reinterpret_cast<Floats>(bits_of(a) & 0x7FFFFFFF); };
    const Floats x = size(dir[0]), y = size(dir[1]), z = size(dir[2]);
    const Ints octant = -(negative(dir[0]) + 2 * negative(dir[1]) + 4 * negative(dir[2]));
    const Ints x_is_longest = (x >= y) & (x >= z);  // -1 or 0
    const Ints y_is_longest = ~x_is_longest & (y >= z);
    return octant + 2 * octant + 2 + 2 * x_is_longest + y_is_longest;
}

/// Cells over where a sample of the rays starts, which may be a small part of the scene. Rays that
/// start elsewhere belong to the nearest cell, along each axis.
class OriginCells {
public:
    explicit OriginCells(std::span<const Ray> rays) {
        Bounds3f box;
        const std::size_t stride = std::max(rays.size() / kSamples, std::size_t{1});
        for (std::size_t i = 0; i < rays.size(); i += stride) {
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
    /// The places on a Morton curve.
    [[nodiscard]] Ints codes(const Floats (&org)[3]) const noexcept {
        return cells(org[0], 0) << 2 | cells(org[1], 1) << 1 | cells(org[2], 2);
    }

private:
    static constexpr int kCells = 1 << kCellBits;
    static constexpr std::size_t kSamples = 256;

    /// Along one axis, with room for the bits of the others in between. 0 for NaN.
    [[nodiscard]] Ints cells(Floats x, int axis) const noexcept {
        const Floats place = (x - lower_[axis]) * scale_;
        const Floats inside = place > 0.0f ? place : Floats{};
        const Floats last = Floats{} + static_cast<float>(kCells - 1);
        const Ints cell = __builtin_convertvector(inside < last ? inside : last, Ints);
        static_assert(kCellBits == 4);
        const Ints pairs = (cell | cell << 4) & 0b11000011;
        return (pairs | pairs << 2) & 0b1001001001;
    }

    glm::vec3 lower_{0.0f};
    float scale_ = 0.0f;
};

/// What rays are sorted by: kKeyBits.
PACKET_INLINE Ints keys_of(const Ray* const (&rays)[kTogether], const OriginCells& cells) noexcept {
    const FourRays columns(rays);
    return direction_classes(columns.dir) << 3 * kCellBits | cells.codes(columns.org);
}

/// Calls take(i, key) for each ray.
template <class Take>
void for_each_key(std::span<const Ray> rays, const OriginCells& cells, Take&& take) {
    for (std::size_t first = 0; first < rays.size(); first += kTogether) {
        const std::size_t count = std::min(kTogether, rays.size() - first);
        const Ray* some[kTogether];
        for (std::size_t i = 0; i < kTogether; ++i) some[i] = &rays[first + std::min(i, count - 1)];
        const Ints keys = keys_of(some, cells);
        for (std::size_t i = 0; i < count; ++i)
            take(first + i, static_cast<std::uint32_t>(keys[i]));
    }
}

/// An array in four pieces, which are gone through side by side: neighbours often have the same
/// digit, and its count must be written before it can be read again.
class Pieces {
public:
    explicit Pieces(std::size_t count) : count_(count) {
        while (kTogether << shift_ < count) ++shift_;
    }
    [[nodiscard]] std::size_t length() const noexcept { return std::size_t{1} << shift_; }
    [[nodiscard]] std::size_t piece_of(std::size_t i) const noexcept { return i >> shift_; }
    /// Items 0 to this of each piece have one of each other piece beside them.
    [[nodiscard]] std::size_t complete() const noexcept {
        const std::size_t before_last = (kTogether - 1) * length();
        return count_ > before_last ? count_ - before_last : 0;
    }
    /// Calls take(i, piece) for the others.
    template <class Take>
    void for_rest(Take&& take) const {
        for (std::size_t k = 0; k < kTogether; ++k) {
            const std::size_t end = std::min(count_, (k + 1) * length());
            for (std::size_t i = k * length() + complete(); i < end; ++i) take(i, k);
        }
    }
    /// Calls take(i, piece) for all.
    template <class Take>
    void for_each(Take&& take) const {
        for (std::size_t i = 0; i < complete(); ++i) {
            for (std::size_t k = 0; k < kTogether; ++k) take(k * length() + i, k);
        }
        for_rest(take);
    }

private:
    std::size_t count_;
    int shift_ = 0;
};

/// Of each digit: how many items of each piece have it, then the place of the next one.
template <int kBits>
using PieceCounts = std::array<std::array<std::uint32_t, kTogether>, 1u << kBits>;

template <std::size_t kCount>
void scan(std::array<std::array<std::uint32_t, kTogether>, kCount>& counts) noexcept {
    std::uint32_t place = 0;
    for (auto& pieces : counts) {
        for (std::uint32_t& count : pieces) place += std::exchange(count, place);
    }
}

}  // namespace

std::span<const std::uint32_t> StreamOrder::sort(std::span<const Ray> rays) {
    PACKET_ASSERT(rays.size() <= kMostRays);
    items_.resize(rays.size()), scratch_.resize(rays.size());
    const std::span<std::uint32_t> items = items_, scratch = scratch_;
    const OriginCells cells(rays);
    const Pieces pieces(rays.size());
    PieceCounts<kLowBits> low = {};
    PieceCounts<kHighBits> high = {};

    const auto take = [&](std::size_t i, std::size_t piece, std::int32_t key) {
        const std::uint32_t item =
            static_cast<std::uint32_t>(key) << kIndexBits | static_cast<std::uint32_t>(i);
        ++low[low_digit(item)][piece];
        items[i] = item;
    };
    for (std::size_t i = 0; i < pieces.complete(); ++i) {
        const Ray* some[kTogether];
        for (std::size_t k = 0; k < kTogether; ++k) some[k] = &rays[k * pieces.length() + i];
        const Ints keys = keys_of(some, cells);
        for (std::size_t k = 0; k < kTogether; ++k) take(k * pieces.length() + i, k, keys[k]);
    }
    pieces.for_rest([&](std::size_t i, std::size_t piece) {
        const Ray* const ray = &rays[i];
        take(i, piece, keys_of({ray, ray, ray, ray}, cells)[0]);
    });

    scan(low);
    pieces.for_each([&](std::size_t i, std::size_t piece) {
        const std::uint32_t item = items[i];
        const std::uint32_t place = low[low_digit(item)][piece]++;
        ++high[high_digit(item)][pieces.piece_of(place)];
        scratch[place] = item;
    });
    scan(high);
    pieces.for_each([&](std::size_t i, std::size_t piece) {
        const std::uint32_t item = scratch[i];
        items[high[high_digit(item)][piece]++] = item & ((1u << kIndexBits) - 1);
    });
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
        for_each_key(rays.subspan(begin, end - begin), cells,
                     [&](std::size_t i, std::uint32_t key) {
                         items[begin + i] = {key, first + static_cast<std::uint32_t>(begin + i)};
                     });
    });
    const std::span<const Item> sorted = radix_sort<Item, kLowBits>(
        items, scratch, kKeyBits, parallel, [](const Item& item) { return item.key; });
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
