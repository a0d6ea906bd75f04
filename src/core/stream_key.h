// What rays are sorted by to become streams: the class of their direction, and below it the place
// on a Morton curve of the cell that they start in, so that rays of a stream start near each other.
#pragma once

namespace packet {

/// Cells along each side. Finer ones make no better streams: docs/experiments.md#streams.
inline constexpr int kOriginCellBits = 4, kOriginCells = 1 << kOriginCellBits;

/// Classes are in the order of direction_class(), an octant's four apart.
inline constexpr int kStreamPlaceBits = 3 * kOriginCellBits;
inline constexpr int kStreamKeyBits = kStreamPlaceBits + 5;

/// Cells over where rays start, each 1 / scale wide. Rays that start elsewhere belong to the
/// nearest one along each axis.
struct OriginCells {
    float lower[3] = {0, 0, 0};
    float scale = 0.0f;  ///< 0: one cell holds everything
};

}  // namespace packet
