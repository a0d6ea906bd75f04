// Planes for all cells of a level at once: of large cells by bins, of those within small cells by
// masks. As kd_bins.h and kd_masks.h, whose arithmetic this is.
#pragma once

#include "kd_level.h"
#include "prefix_sums.h"

namespace packet::cuda {

/// The planes of large cells. Keeps its memory from level to level.
class KdBinPlanes {
public:
    /// Fills `planes` and `fates`, by cell: cut, or halved where nothing is to be cut.
    void find(const KdDeviceLevel& level, const KdLimits& limits, KdPlane* planes, KdFate* fates,
              const Stream& stream);

private:
    PrefixSums prefix_sums_;
    DeviceArray<std::uint32_t> chunk_counts_, first_chunks_, bins_;
};

/// The planes of cells within small cells.
class KdMaskPlanes {
public:
    /// Makes the masks of small cells, which are `level`'s.
    void prepare(const KdDeviceLevel& level, const Stream& stream);
    /// Fills `planes` and `fates` of cells within those: leaves where nothing cheaper is to be cut
    /// and no more references remain than a leaf may have.
    void find(const KdDeviceLevel& level, const KdLimits& limits, KdPlane* planes, KdFate* fates,
              const Stream& stream);

    struct View {
        KdMaskPlace* places;           ///< [axis][2 * first reference of the small cell + place]
        std::uint32_t* place_counts;   ///< [axis][small cell]
        std::uint32_t* first_places;   ///< [small cell]
        std::uint32_t places_an_axis;  ///< room
        std::uint32_t roots;
    };

private:
    DeviceArray<KdMaskPlace> places_;
    DeviceArray<std::uint32_t> place_counts_, first_places_;
    View view_ = {};
};

}  // namespace packet::cuda
