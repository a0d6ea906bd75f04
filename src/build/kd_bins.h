// The surface area heuristic over some faces of a large cell's boxes, found without sorting: boxes
// are counted in bins by where they start and end. A plane at the first start or the last end of a
// bin can be counted from the bins alone, and lies where boxes do: walls are not cut an epsilon
// beside them, as they would be by planes between bins.
//
// Wald. On fast construction of SAH-based bounding volume hierarchies. Interactive Ray Tracing
// 2007. Shevtsov, Soupikov, Kapustin. Highly parallel fast KD-tree construction for interactive ray
// tracing of dynamic scenes. CGF 2007 (bins for starts and ends).
#pragma once

#include "build/kd_cell.h"
#include "build/kd_range.h"

#include <limits>

namespace packet {

/// 16 make generated scenes' SAH cost up to 1% higher, 64 up to 0.4% lower or 0.7% higher; in build
/// time there is no difference to be seen.
inline constexpr std::size_t kKdBinCount = 32;

struct KdBin {
    std::uint32_t start_count = 0, end_count = 0;
    float first_start = std::numeric_limits<float>::infinity();
    float last_end = -std::numeric_limits<float>::infinity();
};

/// Where the references of a cell, or of a part of them, start and end along each axis.
class KdBins {
public:
    using Axis = std::array<KdBin, kKdBinCount>;

    void add(const Bounds3f& cell, std::span<const Reference> references) noexcept;
    void join(const KdBins& other) noexcept;
    [[nodiscard]] const Axis& axis(int a) const noexcept {
        return axes_[static_cast<std::size_t>(a)];
    }

private:
    std::array<Axis, 3> axes_;
};

/// The cheapest allowed of these planes by counts that may be too high, never too low; no cut if a
/// leaf is not dearer.
[[nodiscard]] KdPlane find_cheapest_plane(const KdBins& bins, const KdRange& cell,
                                          const BuildOptions& options) noexcept;

}  // namespace packet
