// A row of bins along each axis, and the cheapest border between two of them by the surface area
// heuristic: a sweep from each side, of all axes at once.
#pragma once

#include "build/lane_box.h"
#include "build/sah_costs.h"

#include <cstdint>
#include <limits>

namespace packet {

// More bins find slightly better splits (16 to 32: 0.3% less SAH cost) and build slower.
inline constexpr int kBinCount = 16;

using LaneCounts = xsimd::make_sized_batch_t<std::int32_t, 4>;

/// How many references, by axis.
struct AxisCounts {
    alignas(16) std::int32_t axis[4] = {0, 0, 0, 0};

    PACKET_INLINE void add(const AxisCounts& other) noexcept {
        const LaneCounts sum =
            LaneCounts::load_aligned(axis) + LaneCounts::load_aligned(other.axis);
        sum.store_aligned(axis);
    }
    [[nodiscard]] PACKET_INLINE Lanes lanes() const noexcept {
        return xsimd::to_float(LaneCounts::load_aligned(axis));
    }
};

/// What halves of a node are counted by: references, or the blocks they fill.
class CountUnit {
public:
    CountUnit(std::size_t node_count, const SahCosts& costs) {
        if (!costs.counts_blocks(node_count)) return;
        const auto size = static_cast<float>(costs.block_size);
        per_reference_ = Lanes(1.0f / size);
        to_next_ = Lanes(1.0f - 0.5f / size);
    }
    [[nodiscard]] PACKET_INLINE Lanes of(Lanes references) const noexcept {
        return xsimd::to_float(xsimd::to_int(references * per_reference_ + to_next_));
    }

private:
    Lanes per_reference_ = Lanes(1.0f), to_next_ = Lanes(0.0f);
};

/// What is on one side of a border, by axis.
struct SweepSide {
    LaneBox box[3];
    AxisCounts count;

    PACKET_INLINE void add(const LaneBox (&boxes)[3], const AxisCounts& counts) noexcept {
        for (int a = 0; a < 3; ++a) box[a].extend(boxes[a]);
        count.add(counts);
    }
    /// Area times count.
    [[nodiscard]] PACKET_INLINE Lanes costs(const CountUnit& unit) const noexcept {
        return half_areas(box) * unit.of(count.lanes());
    }
};

/// The cheapest border of each axis.
struct Borders {
    alignas(16) float cost[4];
    alignas(16) float bin[4];  ///< what is below it
};

/// Bins have a `box` for each axis, and counts of what `begins` and what `ends` in them. A border
/// with more than `most` references on both sides together is none.
template <class Bin>
[[nodiscard]] Borders find_borders(const Bin (&bins)[kBinCount], const CountUnit& unit,
                                   float most) noexcept {
    Lanes cost_above[kBinCount], count_above[kBinCount];
    SweepSide above;
    for (int i = kBinCount - 1; i > 0; --i) {
        above.add(bins[i].box, bins[i].ends());
        cost_above[i] = above.costs(unit);
        count_above[i] = above.count.lanes();
    }
    SweepSide below;
    Lanes best(std::numeric_limits<float>::infinity()), best_bin(0.0f);
    for (int i = 1; i < kBinCount; ++i) {
        below.add(bins[i - 1].box, bins[i - 1].begins());
        const Lanes cost = below.costs(unit) + cost_above[i];
        const auto is_best = (cost < best) & (below.count.lanes() + count_above[i] <= Lanes(most));
        best = xsimd::select(is_best, cost, best);
        best_bin = xsimd::select(is_best, Lanes(static_cast<float>(i)), best_bin);
    }
    Borders out;
    best.store_aligned(out.cost);
    best_bin.store_aligned(out.bin);
    return out;
}

/// The bounds of bins `begin` to `end` along an axis.
template <class Bin>
[[nodiscard]] Bounds3f join_bins(const Bin (&bins)[kBinCount], int axis, int begin,
                                 int end) noexcept {
    LaneBox out;
    for (int i = begin; i < end; ++i) out.extend(bins[i].box[axis]);
    return out.bounds();
}

}  // namespace packet
