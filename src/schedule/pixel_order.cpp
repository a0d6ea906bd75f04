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
static std::size_t even_bits(std::size_t code) noexcept {
    return (code & 1) | (code >> 1 & 2) | (code >> 2 & 4);
}

std::size_t PixelOrder::fill(std::size_t tile, Indices& out) const noexcept {
    constexpr std::size_t kSquares = kTileSize / kSquareSize;
    static_assert(kSquares == 8, "three bits a coordinate");
    const std::size_t x_begin = tile % tiles_x_ * kTileSize;
    const std::size_t x_end = std::min(x_begin + kTileSize, width_);
    const std::size_t rays_left = count_ - first_ray(tile);
    std::size_t filled = 0;
    for (std::size_t square = 0; square < kSquares * kSquares; ++square) {
        const std::size_t x0 = x_begin + even_bits(square) * kSquareSize;
        const std::size_t y0 = even_bits(square >> 1) * kSquareSize;
        const std::size_t first = y0 * width_ + x0;
        const std::size_t last = first + (kSquareSize - 1) * (width_ + 1);
        if (x0 + kSquareSize <= x_end && last < rays_left) {
            for (std::size_t i = 0; i < kSquareSize * kSquareSize; ++i) {
                out[filled++] =
                    static_cast<std::uint32_t>(first + i / kSquareSize * width_ + i % kSquareSize);
            }
            continue;
        }
        for (std::size_t y = y0; y < y0 + kSquareSize; ++y) {
            for (std::size_t x = x0; x < std::min(x0 + kSquareSize, x_end); ++x) {
                const std::size_t ray = y * width_ + x;
                if (ray < rays_left) out[filled++] = static_cast<std::uint32_t>(ray);
            }
        }
    }
    return filled;
}

}  // namespace packet
