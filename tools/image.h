// Images of 8 bits a channel, and PNG files of them.
#pragma once

#include "camera.h"
#include "output_file.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace packet::tools {

/// The largest width and height: the PNG writer counts bytes in an int.
inline constexpr int kMaxImageSide = 16384;

struct Image {
    ImageSize size;
    std::vector<std::uint8_t> rgb;  ///< 3 bytes a pixel, scanline order from the top
};

/// An image of colors in [0, 1], clamped to that; one a pixel, in scanline order.
[[nodiscard]] Image to_image(ImageSize size, std::span<const glm::vec3> colors);

/// Writes a PNG and commits the file. Throws Error{kIo}, and nothing stays then.
void write_png(OutputFile file, const Image& image);

/// The sRGB curve: what a display wants for an amount of light. Clamps to [0, 1].
[[nodiscard]] glm::vec3 encode_srgb(const glm::vec3& light);

/// From dark blue at 0 to pale yellow at 1. Lightness rises evenly, so that equal steps look equal
/// and the order survives printing in grey and colour blindness.
[[nodiscard]] glm::vec3 heat_color(float value);

}  // namespace packet::tools
