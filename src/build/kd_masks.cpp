#include "build/kd_masks.h"

#include "core/macros.h"

#include <algorithm>

namespace packet {

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
        KdMaskPlace place{faces[i].position, 0, 0, before, 0};
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
                                     const KdPrices& prices) const noexcept {
    const KdCost cost(cell, prices);
    KdSearch<KdRange> search(cell, cost);
    for (int a = 0; a < 3; ++a) sweep(axes_[static_cast<std::size_t>(a)], a, set, search);
    return search.best;
}

void KdMasks::sweep(const Axis& places, int axis, KdSet set, KdSearch<KdRange>& search) noexcept {
    float next_start = search.cell.bounds.upper[axis];
    for (std::size_t i = places.count; i-- > 0;) {
        const KdMaskPlace& place = places.places[i];
        if (!place.is_of(set, search.cell.bounds, axis)) {
            if (place.position < search.cell.bounds.lower[axis]) break;
            continue;
        }
        consider_planes(place, set, next_start, axis, search);
        if ((place.starts & set) != 0) next_start = place.position;
    }
}

}  // namespace packet
