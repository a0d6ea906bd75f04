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

std::size_t PixelOrder::fill(std::size_t tile, Indices& out) const noexcept {
    const std::size_t x_begin = tile % tiles_x_ * kTileSize;
    const std::size_t x_end = std::min(x_begin + kTileSize, width_);
    const std::size_t rays_left = count_ - first_ray(tile);
    std::size_t filled = 0;
    for (std::size_t sy = 0; sy < kTileSize; sy += kSquareSize) {
        for (std::size_t sx = x_begin; sx < x_end; sx += kSquareSize) {
            for (std::size_t y = sy; y < sy + kSquareSize; ++y) {
                for (std::size_t x = sx; x < std::min(sx + kSquareSize, x_end); ++x) {
                    const std::size_t ray = y * width_ + x;
                    if (ray < rays_left) out[filled++] = static_cast<std::uint32_t>(ray);
                }
            }
        }
    }
    return filled;
}

}  // namespace packet
