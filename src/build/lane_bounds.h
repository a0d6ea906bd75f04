// The bounds of references and of their centroids, in registers.
#pragma once

#include "build/lane_box.h"
#include "build/split.h"

namespace packet {

/// Twice the centroid, as centroid2. The last lane is 0: ids' bits are denormal floats, which CPUs
/// take a hundred cycles to add.
[[nodiscard]] PACKET_INLINE Lanes centroid2_lanes(const Reference& r) noexcept {
    return without_last(lower_lanes(r)) + upper_lanes(r);
}

/// NodeBounds as they are gathered.
struct LaneBounds {
    LaneBox box, centroids;

    PACKET_INLINE void extend(const Reference& r) noexcept {
        box.extend(lower_lanes(r), upper_lanes(r));
        const Lanes c = centroid2_lanes(r);
        centroids.extend(c, c);
    }
    [[nodiscard]] NodeBounds node_bounds() const noexcept {
        return {box.bounds(), centroids.bounds()};
    }
};

}  // namespace packet
