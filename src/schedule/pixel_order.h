// The order in which an image's rays are traced, in scanlines or in blocks: square tiles, in
// them squares of 4 x 4 along a Morton curve. So a packet of 16 is a square, one of 8 is half of
// it, and 128 rays are a block of 16 x 8.
#pragma once

#include "schedule/pixel_layout.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace packet {

/// The rays of a tile, as TraceBatch has them.
struct PixelTile {
    std::size_t count;
    int row_bits;  ///< 2^row_bits rays follow each other from each index on
};

class PixelOrder {
public:
    static constexpr std::size_t kTileSize = 32;
    static constexpr int kSquareBits = 2;
    static constexpr std::size_t kSquareSize = std::size_t{1} << kSquareBits;
    using Indices = std::array<std::uint32_t, kTileSize * kTileSize>;

    /// `count` rays: in scanlines, of which the last may be short, or in blocks with sides of 4, 8,
    /// 16 or 32 that fill an image. A width that does not leave two lines, or that
    /// 32 bits cannot index, means no image.
    PixelOrder(std::size_t count, const PixelLayout& layout) noexcept;

    [[nodiscard]] bool is_image() const noexcept { return layout_.is_image(); }
    [[nodiscard]] std::size_t tile_count() const noexcept { return tiles_x_ * tiles_y_; }
    /// The ray that a tile's indices count from.
    [[nodiscard]] std::size_t first_ray(std::size_t tile) const noexcept;
    /// Fills in the rays of a tile, relative to first_ray().
    PixelTile fill(std::size_t tile, Indices& out) const noexcept;

private:
    std::size_t count_ = 0;
    PixelLayout layout_;
    std::size_t tiles_x_ = 0, tiles_y_ = 0;
};

}  // namespace packet
