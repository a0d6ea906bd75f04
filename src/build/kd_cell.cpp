#include "build/kd_cell.h"

#include "build/clip.h"
#include "core/views.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace packet {

// References: about a millisecond of work.
static constexpr std::size_t kCheckInterval = 65536;

/// `side_of(i)` tells where reference i goes.
template <class SideOf>
static void deal_whole(const KdCell& cell, const Parallel& parallel, KdChildren& out,
                       SideOf side_of) {
    const std::size_t count = cell.references.size();
    out.places.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        if (i % kCheckInterval == 0) parallel.check();
        const int side = side_of(i);
        if (side == kBothSides) {
            out.places[i] = kCut;
            continue;
        }
        KdCell& child = out.cell[static_cast<std::size_t>(side)];
        out.places[i] =
            static_cast<KdPlace>(2 * child.references.size()) + static_cast<KdPlace>(side);
        child.add(cell.references[i]);
    }
    for (std::size_t s = 0; s < 2; ++s) out.whole[s] = out.cell[s].references.size();
}

static void inherit(const KdCell& cell, KdChildren& out) {
    share_out<KdCell>(cell, out.cell);
    for (KdCell& child : out.cell) child.depth = cell.depth + 1;
}

KdChildren cut_cell(MeshView mesh, const KdCell& cell, const KdPlane& plane,
                    const Parallel& parallel) {
    KdChildren out;
    deal_whole(cell, parallel, out,
               [&](std::size_t i) { return plane.side_of(cell.references[i]); });
    for (std::size_t i = 0; i < cell.references.size(); ++i) {
        if (out.places[i] != kCut) continue;
        const CutReference cut =
            cut_reference(mesh, cell.references[i], plane.axis, plane.position);
        for (std::size_t s = 0; s < 2; ++s) {
            if (!cut.side[s].bounds().empty()) out.cell[s].add(cut.side[s]);
        }
    }
    inherit(cell, out);
    return out;
}

int max_cut_depth(std::size_t reference_count) noexcept {
    const double levels = std::log2(static_cast<double>(reference_count));
    return std::min(kMaxDepth, static_cast<int>(8.0 + 1.3 * levels));
}

std::vector<std::uint8_t> sides_of_halves(std::span<const Reference> references,
                                          const Bounds3f& bounds) {
    const int axis = widest_axis(bounds);
    const auto centroid2 = [&](std::uint32_t i) {
        return references[i].lower[axis] + references[i].upper[axis];
    };
    std::vector<std::uint32_t> order(references.size());
    std::iota(order.begin(), order.end(), 0u);
    const std::size_t half = order.size() / 2;
    std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                         const float ca = centroid2(a), cb = centroid2(b);
                         return ca < cb || (ca == cb && a < b);
                     });
    std::vector<std::uint8_t> side(order.size(), 0);
    for (std::size_t i = half; i < order.size(); ++i) side[order[i]] = 1;
    return side;
}

KdChildren halve_cell(const KdCell& cell, const Parallel& parallel) {
    const std::vector<std::uint8_t> side = sides_of_halves(cell.references, cell.bounds);
    KdChildren out;
    deal_whole(cell, parallel, out, [&](std::size_t i) { return static_cast<int>(side[i]); });
    inherit(cell, out);
    return out;
}

}  // namespace packet
