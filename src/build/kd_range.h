// Cells of a k-d tree that is built level by level: the references of a whole level are in one
// array, a range of it for each cell.
#pragma once

#include "build/references.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace packet {

struct KdRange {
    Bounds3f bounds;                   ///< of the references' boxes
    std::size_t first = 0, count = 0;  ///< references
    std::size_t spare = 0;             ///< how many references cuts in here may add
    double work = 1.0;                 ///< how much of the build it is
    int depth = 0;
    std::uint32_t node = 0;  ///< of the hierarchy, that it becomes

    [[nodiscard]] constexpr std::size_t reference_count() const noexcept { return count; }
};

struct KdLevel {
    ScratchVector<Reference> references;
    std::vector<KdRange> cells;

    [[nodiscard]] std::span<const Reference> references_of(const KdRange& cell) const noexcept {
        return std::span<const Reference>(references).subspan(cell.first, cell.count);
    }
};

}  // namespace packet
