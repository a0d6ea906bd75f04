#include "build/kd_bins.h"

#include <algorithm>

namespace packet {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The bin of a position in a cell along one axis; never decreases with the position.
struct BinOf {
    float lower, scale;

    BinOf(float from, float to)
        : lower(from), scale(static_cast<float>(kKdBinCount) / (to - from)) {
        if (!(scale < kInfinity)) scale = 0.0f;  // flat, or nearly: all in one bin
    }
    [[nodiscard]] std::size_t operator()(float position) const noexcept {
        constexpr int kLast = static_cast<int>(kKdBinCount) - 1;
        return static_cast<std::size_t>(
            std::min(static_cast<int>((position - lower) * scale), kLast));
    }
};

/// Looks at the planes across one axis.
void sweep(const KdBins::Axis& bins, int axis, const KdRange& cell, const KdCost& cost,
           KdPlane& best) noexcept {
    const auto consider = [&](float position, float end, const KdCounts& counts, int flat_side) {
        if (!counts.allow_cut(cell)) return;
        const double c = cost.cut(axis, end, position, counts);
        if (c < best.cost) best = {c, position, axis, flat_side};
    };
    std::size_t started = 0, ended = 0;  // in the bins before
    float last_end = -kInfinity;
    for (const KdBin& bin : bins) {
        if (bin.start_count != 0) {
            // What ends in this bin may end after the plane.
            const float p = bin.first_start;
            const bool ends_before = bin.last_end < p;
            const std::size_t above =
                cell.count - ended - (ends_before ? std::size_t{bin.end_count} : 0);
            // Nothing lies between the last end and a plane that cuts nothing.
            const bool is_gap = started + above == cell.count;
            const float end =
                is_gap ? std::max(last_end, ends_before ? bin.last_end : -kInfinity) : p;
            consider(p, end, {{started, above}}, 1);
        }
        if (bin.end_count != 0) {
            // What starts in this bin may start before the plane.
            const float p = bin.last_end;
            const std::size_t below =
                started + (bin.first_start > p ? 0 : std::size_t{bin.start_count});
            consider(p, p, {{below, cell.count - ended - bin.end_count}}, 0);
            last_end = p;
        }
        started += bin.start_count;
        ended += bin.end_count;
    }
}

}  // namespace

void KdBins::add(const Bounds3f& cell, std::span<const Reference> references) noexcept {
    for (int a = 0; a < 3; ++a) {
        const BinOf bin_of(cell.lower[a], cell.upper[a]);
        Axis& bins = axes_[static_cast<std::size_t>(a)];
        for (const Reference& r : references) {
            KdBin& start = bins[bin_of(r.lower[a])];
            ++start.start_count;
            start.first_start = std::min(start.first_start, r.lower[a]);
            KdBin& end = bins[bin_of(r.upper[a])];
            ++end.end_count;
            end.last_end = std::max(end.last_end, r.upper[a]);
        }
    }
}

void KdBins::join(const KdBins& other) noexcept {
    for (std::size_t a = 0; a < axes_.size(); ++a) {
        for (std::size_t b = 0; b < kKdBinCount; ++b) {
            KdBin& to = axes_[a][b];
            const KdBin& from = other.axes_[a][b];
            to.start_count += from.start_count;
            to.end_count += from.end_count;
            to.first_start = std::min(to.first_start, from.first_start);
            to.last_end = std::max(to.last_end, from.last_end);
        }
    }
}

KdPlane find_cheapest_plane(const KdBins& bins, const KdRange& cell,
                            const BuildOptions& options) noexcept {
    const KdCost cost(cell, options);
    KdPlane best;
    best.cost = cost.leaf();
    for (int a = 0; a < 3; ++a) sweep(bins.axis(a), a, cell, cost, best);
    return best;
}

}  // namespace packet
