#include "schedule/pixel_order.h"

#include <algorithm>
#include <limits>

namespace packet {

PixelOrder::PixelOrder(std::size_t count, const PixelLayout& layout) noexcept : count_(count) {
    const std::size_t width = layout.width;
    if (width == 0 || width >= count ||
        width > std::numeric_limits<std::uint32_t>::max() / (2 * kTileSize)) {
        return;
    }
    layout_ = layout;
    const std::size_t height = (count + width - 1) / width;
    tiles_x_ = (width + kTileSize - 1) / kTileSize;
    tiles_y_ = (height + kTileSize - 1) / kTileSize;
}

std::size_t PixelOrder::first_ray(std::size_t tile) const noexcept {
    return tile / tiles_x_ * kTileSize * layout_.width;
}

/// The even bits of a Morton code.
static std::uint32_t even_bits(std::uint32_t code) noexcept {
    return (code & 1) | (code >> 1 & 2) | (code >> 2 & 4);
}

PixelTile PixelOrder::fill(std::size_t tile, Indices& out) const noexcept {
    constexpr std::size_t kSquares = kTileSize / kSquareSize;
    static_assert(kSquares == 8, "three bits a coordinate");
    const std::size_t x_begin = tile % tiles_x_ * kTileSize, first = first_ray(tile);
    const std::size_t width = std::min(kTileSize, layout_.width - x_begin);
    const std::size_t left = count_ - first;
    const std::size_t height = std::min(kTileSize, (left + layout_.width - 1) / layout_.width);
    const std::size_t columns = (width + kSquareSize - 1) / kSquareSize;
    const std::size_t rows = (height + kSquareSize - 1) / kSquareSize;
    // The lines of a square are block_width apart: in a block, and in scanlines, too.
    std::size_t column[kSquares], row[kSquares];
    for (std::size_t i = 0; i < columns; ++i) column[i] = layout_.column(x_begin + i * kSquareSize);
    for (std::size_t i = 0; i < rows; ++i) row[i] = layout_.row(i * kSquareSize);

    const bool is_whole =
        width % kSquareSize == 0 && height % kSquareSize == 0 && height * layout_.width <= left;
    std::size_t filled = 0;
    for (std::uint32_t square = 0; square < kSquares * kSquares; ++square) {
        const std::size_t i = even_bits(square), j = even_bits(square >> 1);
        if (i >= columns || j >= rows) continue;
        std::size_t ray = column[i] + row[j];
        if (is_whole) {
            for (std::size_t y = 0; y < kSquareSize; ++y, ray += layout_.block_width)
                out[filled++] = static_cast<std::uint32_t>(ray);
            continue;
        }
        const std::size_t x_end = std::min(kSquareSize, width - i * kSquareSize);
        const std::size_t y_end = std::min(kSquareSize, height - j * kSquareSize);
        for (std::size_t y = 0; y < y_end; ++y, ray += layout_.block_width) {
            for (std::size_t x = 0; x < x_end && ray + x < left; ++x)
                out[filled++] = static_cast<std::uint32_t>(ray + x);
        }
    }
    if (is_whole) return {filled * kSquareSize, kSquareBits};
    return {filled, 0};
}

}  // namespace packet
