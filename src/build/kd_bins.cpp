#include "build/kd_bins.h"

#include <algorithm>

namespace packet {

void KdBins::add(const Bounds3f& cell, std::span<const Reference> references) noexcept {
    for (int a = 0; a < 3; ++a) {
        const KdBinOf bin_of(cell.lower[a], cell.upper[a]);
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
                            const KdPrices& prices) noexcept {
    const KdCost cost(cell, prices);
    KdSearch<KdRange> search(cell, cost);
    for (int a = 0; a < 3; ++a) {
        KdBinsBefore before;
        for (const KdBin& bin : bins.axis(a)) {
            consider_planes(bin, before, a, search);
            before.add(bin);
        }
    }
    return search.best;
}

}  // namespace packet
