#include "schedule/stream_order.h"

#include "core/macros.h"
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

// What is sorted: a key and the index of a ray, or of a run of them, in one word. Two passes do.
constexpr int kIndexBits = 14, kLowBits = 9, kHighBits = 8;
constexpr int kHighShift = kIndexBits + kLowBits;
static_assert(StreamOrder::kMostRays == std::size_t{1} << kIndexBits);
static_assert(kLowBits + kHighBits == kStreamKeyBits);

constexpr std::uint32_t make_item(std::uint32_t key, std::size_t index) noexcept {
    return key << kIndexBits | static_cast<std::uint32_t>(index);
}
constexpr std::uint32_t index_of(std::uint32_t item) noexcept {
    return item & ((1u << kIndexBits) - 1);
}
constexpr std::uint32_t low_digit(std::uint32_t item) noexcept {
    return item >> kIndexBits & ((1u << kLowBits) - 1);
}
constexpr std::uint32_t high_digit(std::uint32_t item) noexcept { return item >> kHighShift; }

/// Indices of a run that are written at a time, the last ones beyond its end.
constexpr std::uint32_t kRunStep = 16;

/// Pieces that an array is gone through by side by side.
constexpr std::size_t kPieces = 4;

/// An array in four pieces, which are gone through side by side: neighbours often have the same
/// digit, and its count must be written before it can be read again.
class Pieces {
public:
    explicit Pieces(std::size_t count) : count_(count) {
        while (kPieces << shift_ < count) ++shift_;
    }
    [[nodiscard]] std::size_t piece_of(std::size_t i) const noexcept { return i >> shift_; }
    /// Calls take(i, piece) for all.
    template <class Take>
    void for_each(Take&& take) const {
        const std::size_t length = std::size_t{1} << shift_, before_last = (kPieces - 1) * length;
        // So many items of each piece have one of each other piece beside them.
        const std::size_t complete = count_ > before_last ? count_ - before_last : 0;
        for (std::size_t i = 0; i < complete; ++i) {
            for (std::size_t k = 0; k < kPieces; ++k) take(k * length + i, k);
        }
        for (std::size_t k = 0; k < kPieces; ++k) {
            const std::size_t end = std::min(count_, (k + 1) * length);
            for (std::size_t i = k * length + complete; i < end; ++i) take(i, k);
        }
    }

private:
    std::size_t count_;
    int shift_ = 0;
};

/// Of each digit: how many items of each piece have it, then the place of the next one.
template <int kBits>
using PieceCounts = std::array<std::array<std::uint32_t, kPieces>, 1u << kBits>;

template <std::size_t kCount>
void scan(std::array<std::array<std::uint32_t, kPieces>, kCount>& counts) noexcept {
    std::uint32_t place = 0;
    for (auto& pieces : counts) {
        for (std::uint32_t& count : pieces) place += std::exchange(count, place);
    }
}

/// Items in the order of their keys, and of equal ones in that in which they come, become their
/// indices.
void sort_items(std::span<std::uint32_t> items, std::span<std::uint32_t> scratch) {
    const Pieces pieces(items.size());
    PieceCounts<kLowBits> low = {};
    PieceCounts<kHighBits> high = {};
    pieces.for_each([&](std::size_t i, std::size_t piece) { ++low[low_digit(items[i])][piece]; });
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
        items[high[high_digit(item)][piece]++] = index_of(item);
    });
}

}  // namespace

OriginCells find_origin_cells(std::span<const Ray> rays) {
    constexpr std::size_t kSamples = 256;
    Bounds3f box;
    const std::size_t stride = std::max(rays.size() / kSamples, std::size_t{1});
    for (std::size_t i = 0; i < rays.size(); i += stride) {
        const glm::vec3& org = rays[i].org;
        // false for NaN and infinity, which would leave one cell for all others
        if (glm::all(glm::lessThan(glm::abs(org), glm::vec3(kMaxCoordinate)))) box.extend(org);
    }
    OriginCells out;
    if (box.empty()) return out;
    const glm::vec3 extent = box.extent();
    const float scale =
        static_cast<float>(kOriginCells) / std::max(std::max(extent.x, extent.y), extent.z);
    // No extent, or one so small that floats do not resolve it: one cell.
    if (std::isfinite(scale)) out = {{box.lower.x, box.lower.y, box.lower.z}, scale};
    return out;
}

std::span<const std::uint32_t> StreamOrder::sort(std::span<const Ray> rays,
                                                 KernelTable::StreamKeys find_keys) {
    PACKET_ASSERT(rays.size() <= kMostRays);
    constexpr std::size_t kLeastRunLength = 4;
    items_.resize(rays.size()), scratch_.resize(rays.size() + kRunStep);
    if (rays.empty()) return {};
    find_keys(rays.data(), rays.size(), find_origin_cells(rays), items_.data());
    std::uint32_t runs = 1;
    for (std::size_t i = 1; i < items_.size(); ++i) runs += items_[i] != items_[i - 1] ? 1 : 0;
    return runs * kLeastRunLength <= rays.size() ? sort_runs(runs) : sort_rays();
}

std::span<const std::uint32_t> StreamOrder::sort_rays() {
    for (std::size_t i = 0; i < items_.size(); ++i) items_[i] = make_item(items_[i], i);
    sort_items(items_, scratch_);
    return items_;
}

std::span<const std::uint32_t> StreamOrder::sort_runs(std::size_t count) {
    // Where runs end nobody can guess: hardly anything branches on it.
    begins_.resize(count + 1);
    begins_[0] = 0;
    std::size_t run = 0;
    for (std::size_t i = 0; i < items_.size(); ++i) {
        const std::uint32_t key = items_[i];
        const bool is_last = i + 1 == items_.size() || items_[i + 1] != key;
        items_[run] = make_item(key, run);  // run <= i: a key that has been read
        begins_[run + 1] = static_cast<std::uint32_t>(i + 1);
        run += is_last ? 1 : 0;
    }
    const std::span<std::uint32_t> sorted = std::span(items_).first(count);
    sort_items(sorted, scratch_);
    std::uint32_t* out = scratch_.data();
    for (const std::uint32_t which : sorted) {
        const std::uint32_t begin = begins_[which], length = begins_[which + 1] - begin;
        for (std::uint32_t done = 0; done < length; done += kRunStep) {
            for (std::uint32_t i = 0; i < kRunStep; ++i) out[done + i] = begin + done + i;
        }
        out += length;
    }
    return std::span(scratch_).first(items_.size());
}

void sort_many(std::span<const Ray> rays, KernelTable::StreamKeys find_keys,
               std::span<std::uint32_t> out, std::uint32_t first, const Parallel& parallel) {
    PACKET_ASSERT(out.size() == rays.size());
    constexpr std::size_t kGrain = 65536;  // 100 us or more
    struct Item {
        std::uint32_t key, index;
    };
    const OriginCells cells = find_origin_cells(rays);
    ScratchVector<Item> items(rays.size()), scratch(rays.size());
    parallel.for_pieces(rays.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        find_keys(rays.data() + begin, end - begin, cells, out.data() + begin);
        for (std::size_t i = begin; i < end; ++i) {
            items[i] = {out[i], first + static_cast<std::uint32_t>(i)};
        }
    });
    const std::span<const Item> sorted = radix_sort<Item, kLowBits>(
        items, scratch, kStreamKeyBits, parallel, [](const Item& item) { return item.key; });
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
