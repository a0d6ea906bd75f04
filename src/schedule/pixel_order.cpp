#include "schedule/pixel_order.h"

#include <algorithm>
#include <limits>

namespace packet {

PixelOrder::PixelOrder(std::size_t count, int width) noexcept : count_(count) {
    const auto line = static_cast<std::size_t>(std::max(width, 0));
    if (line == 0 || line >= count ||
        line > std::numeric_limits<std::uint32_t>::max() / (2 * kTileSize)) {
        return;
    }
    width_ = line;
    const std::size_t height = (count + width_ - 1) / width_;
    tiles_x_ = (width_ + kTileSize - 1) / kTileSize;
    tiles_y_ = (height + kTileSize - 1) / kTileSize;
}

std::size_t PixelOrder::first_ray(std::size_t tile) const noexcept {
    return tile / tiles_x_ * kTileSize * width_;
}

/// The even bits of a Morton code.
static std::uint32_t even_bits(std::uint32_t code) noexcept {
    return (code & 1) | (code >> 1 & 2) | (code >> 2 & 4);
}

bool PixelOrder::is_whole(std::size_t tile) const noexcept {
    const std::size_t x_end = (tile % tiles_x_ + 1) * kTileSize;
    const std::size_t last = first_ray(tile) + (kTileSize - 1) * width_ + x_end - 1;
    return x_end <= width_ && last < count_;
}

PixelTile PixelOrder::fill(std::size_t tile, Indices& out) const noexcept {
    constexpr std::size_t kSquares = kTileSize / kSquareSize;
    static_assert(kSquares == 8, "three bits a coordinate");
    const std::size_t x_begin = tile % tiles_x_ * kTileSize;
    if (is_whole(tile)) {
        const auto line = static_cast<std::uint32_t>(width_);
        const auto begin = static_cast<std::uint32_t>(x_begin);
        constexpr std::uint32_t kEdge = kSquareSize;
        std::uint32_t* row = out.data();
        for (std::uint32_t square = 0; square < kSquares * kSquares; ++square) {
            std::uint32_t ray = begin + (even_bits(square >> 1) * line + even_bits(square)) * kEdge;
            for (std::size_t y = 0; y < kSquareSize; ++y, ray += line) *row++ = ray;
        }
        return {kTileSize * kTileSize, kSquareBits};
    }
    const std::size_t x_end = std::min(x_begin + kTileSize, width_);
    const std::size_t rays_left = count_ - first_ray(tile);
    std::size_t filled = 0;
    for (std::uint32_t square = 0; square < kSquares * kSquares; ++square) {
        const std::size_t x0 = x_begin + even_bits(square) * kSquareSize;
        const std::size_t y0 = even_bits(square >> 1) * kSquareSize;
        for (std::size_t y = y0; y < y0 + kSquareSize; ++y) {
            for (std::size_t x = x0; x < std::min(x0 + kSquareSize, x_end); ++x) {
                const std::size_t ray = y * width_ + x;
                if (ray < rays_left) out[filled++] = static_cast<std::uint32_t>(ray);
            }
        }
    }
    return {filled, 0};
}

}  // namespace packet
