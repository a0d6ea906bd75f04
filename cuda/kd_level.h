// A level of a k-d tree in the device's memory: as KdLevel, with what threads need to find their
// way.
#pragma once

#include "build/kd_masks.h"
#include "build/kd_range.h"
#include "item_launch.h"

#include <cstdint>

namespace packet::cuda {

/// Of a small cell's references, bit i for reference i: in Reference::unused, while there is a use.
using KdBit = std::uint32_t;

struct KdSetCell : KdRange {
    KdSet set = 0;           ///< small stage: which of the small cell's references it holds
    std::uint32_t root = 0;  ///< small stage: the small cell
};

/// What becomes of a cell.
enum class KdFate : std::uint32_t {
    kLeaf,   ///< stays whole
    kCut,    ///< by its plane
    kHalved  ///< parted by its references' centroids, none of which is cut
};

/// What kernels see of a level.
struct KdLevelView {
    const Reference* references;
    const std::uint32_t* cell_of;  ///< by reference
    const KdSetCell* cells;
    std::uint32_t reference_count, cell_count;
};

struct KdDeviceLevel {
    DeviceArray<Reference> references;
    DeviceArray<std::uint32_t> cell_of;
    DeviceArray<KdSetCell> cells;
    std::uint32_t reference_count = 0, cell_count = 0;

    [[nodiscard]] KdLevelView view() const noexcept {
        return {references.data(), cell_of.data(), cells.data(), reference_count, cell_count};
    }
    /// Makes room behind what there is.
    void grow(std::uint32_t more_references, std::uint32_t more_cells, const Stream& stream) {
        references.grow(reference_count + more_references, reference_count, stream);
        cell_of.grow(reference_count + more_references, reference_count, stream);
        cells.grow(cell_count + more_cells, cell_count, stream);
    }
};

/// What the surface area heuristic needs beside the cells.
struct KdLimits {
    KdPrices prices;
    int max_cut_depth;
    std::uint32_t max_leaf_size;
};

}  // namespace packet::cuda
