// How the rays of an image follow each other in memory, as they say or as it shows.
#pragma once

#include <packet/bounds.h>
#include <packet/ray.h>

#include <cstddef>
#include <span>

namespace packet {

/// Blocks of pixels, line by line in each of them, and blocks line by line. Scanlines are blocks of
/// a line each.
struct PixelLayout {
    std::size_t width = 0;  ///< pixels to a line of the image; 0: the rays are no image's
    std::size_t block_width = 0, block_height = 1;

    [[nodiscard]] static PixelLayout scanlines(std::size_t width) noexcept {
        return {width, width, 1};
    }
    friend bool operator==(const PixelLayout&, const PixelLayout&) = default;

    [[nodiscard]] bool is_image() const noexcept { return width != 0; }
    /// Pixel (x, y) is ray column(x) + row(y).
    [[nodiscard]] std::size_t column(std::size_t x) const noexcept {
        return x / block_width * (block_width * block_height) + x % block_width;
    }
    [[nodiscard]] std::size_t row(std::size_t y) const noexcept {
        return y / block_height * (width * block_height) + y % block_height * block_width;
    }
};

/// The layout of rays of which nobody says that they are an image's, from 1024 on: a camera's rays,
/// and others whose neighbours pass the scene side by side, jump back where a line or a block ends.
/// Looked for are lines of at most a 32nd of all rays and 16,384 pixels: scanlines from 8 pixels
/// on, and blocks with sides of 4, 8, 16 or 32 that fill the image; larger ones, and others 8
/// pixels wide or more, are taken for an image as wide as they are. No image where there is none of
/// these, and where a bad ray lies where a line or block ends. Looks at as many rays as are in a
/// line, or as may be, and some 350 more.
[[nodiscard]] PixelLayout find_layout(std::span<const Ray> rays, const Bounds3f& world);

}  // namespace packet
