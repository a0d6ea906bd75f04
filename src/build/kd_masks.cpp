#include "build/kd_masks.h"

#include "core/macros.h"

#include <algorithm>
#include <bit>

namespace packet {

static std::size_t size_of(KdSet set) noexcept {
    return static_cast<std::size_t>(std::popcount(set));
}

KdMasks::KdMasks(std::span<const Reference> references) {
    PACKET_ASSERT(references.size() <= kMaxSetSize);
    for (int a = 0; a < 3; ++a) fill(references, a, axes_[static_cast<std::size_t>(a)]);
}

void KdMasks::fill(std::span<const Reference> references, int axis, Axis& out) {
    struct Face {
        float position;
        std::uint32_t reference;
        bool is_end;
    };
    std::array<Face, 2 * kMaxSetSize> faces;
    std::size_t count = 0;
    KdSet behind = 0, before = 0;
    for (std::uint32_t i = 0; i < references.size(); ++i) {
        faces[count++] = {references[i].lower[axis], i, false};
        faces[count++] = {references[i].upper[axis], i, true};
        behind |= KdSet{1} << i;
    }
    std::sort(faces.begin(), faces.begin() + count,
              [](const Face& a, const Face& b) { return a.position < b.position; });
    out.count = 0;
    for (std::size_t i = 0; i < count;) {
        Place place{faces[i].position, 0, 0, before, 0};
        for (; i < count && faces[i].position == place.position; ++i) {
            (faces[i].is_end ? place.ends : place.starts) |= KdSet{1} << faces[i].reference;
        }
        behind &= ~place.ends;
        before |= place.starts;
        place.behind = behind;
        out.places[out.count++] = place;
    }
}

KdPlane KdMasks::find_cheapest_plane(KdSet set, const KdRange& cell,
                                     const BuildOptions& options) const noexcept {
    const KdCost cost(cell, options);
    KdPlane best;
    best.cost = cost.leaf();
    for (int a = 0; a < 3; ++a) {
        sweep(axes_[static_cast<std::size_t>(a)], a, set, cell, cost, best);
    }
    return best;
}

void KdMasks::sweep(const Axis& places, int axis, KdSet set, const KdRange& cell,
                    const KdCost& cost, KdPlane& best) noexcept {
    const auto consider = [&](float position, float end, float begin, std::size_t below,
                              std::size_t above, int flat_side) {
        const KdCounts counts{{below, above}};
        if (!counts.allow_cut(cell)) return;
        const double c = cost.cut(axis, end, begin, counts);
        if (c < best.cost) best = {c, position, axis, flat_side};
    };
    float next_start = cell.bounds.upper[axis];  // of what is not in the plane or below
    for (std::size_t i = places.count; i-- > 0;) {
        const Place& place = places.places[i];
        const float p = place.position;
        if (((place.starts | place.ends) & set) == 0 || p > cell.bounds.upper[axis]) {
            continue;
        }
        if (p < cell.bounds.lower[axis]) break;
        const std::size_t below = size_of(place.before & set);
        const std::size_t above = size_of(place.behind & set);
        const KdSet in_plane = set & ~(place.before | place.behind);
        const std::size_t flat = in_plane == 0 ? 0 : size_of(in_plane);
        if ((place.starts & place.behind & set) != 0) next_start = p;
        // Nothing lies between a plane that cuts nothing and where the next box starts.
        const bool is_gap = below + flat + above == cell.count;
        consider(p, p, is_gap ? next_start : p, below + flat, above, 0);
        if (flat == 0) continue;
        consider(p, p, p, below, above + flat, 1);
        next_start = p;
    }
}

}  // namespace packet
