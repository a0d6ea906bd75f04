// Images of 8 bits a channel, and PNG files of them.
#include "image.h"

#include <packet/error.h>

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/vector_relational.hpp>

#define STB_IMAGE_WRITE_STATIC  // other libraries of a program may bring a copy of their own
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>

#include <algorithm>
#include <cstddef>
#include <iterator>

namespace packet::tools {

Image to_image(ImageSize size, std::span<const glm::vec3> colors) {
    Image image{size, {}};
    image.rgb.reserve(3 * colors.size());
    for (const glm::vec3& color : colors) {
        const glm::vec3 bytes = 255.0f * glm::clamp(color, 0.0f, 1.0f) + 0.5f;
        for (int c = 0; c < 3; ++c) image.rgb.push_back(static_cast<std::uint8_t>(bytes[c]));
    }
    return image;
}

void write_png(OutputFile file, const Image& image) {
    std::vector<std::byte> png;
    const auto append = [](void* context, void* data, int size) {
        const auto* bytes = static_cast<const std::byte*>(data);
        auto& target = *static_cast<std::vector<std::byte>*>(context);
        target.insert(target.end(), bytes, bytes + size);
    };
    if (stbi_write_png_to_func(append, &png, image.size.width, image.size.height, 3,
                               image.rgb.data(), 3 * image.size.width) == 0) {
        throw Error(ErrorCode::kTooLarge, "the image is too large for a PNG file");
    }
    file.write(png);
    file.commit();
}

glm::vec3 encode_srgb(const glm::vec3& light) {
    const glm::vec3 x = glm::clamp(light, 0.0f, 1.0f);
    const glm::vec3 curve = 1.055f * glm::pow(x, glm::vec3(1.0f / 2.4f)) - 0.055f;
    return glm::mix(curve, 12.92f * x, glm::lessThanEqual(x, glm::vec3(0.0031308f)));
}

glm::vec3 heat_color(float value) {
    // Blue, violet, magenta, orange, yellow, each made so light or dark that its CIELAB lightness
    // is 4, 23, 42, 61, 80, 98.
    static constexpr glm::vec3 kColors[] = {{0.05f, 0.03f, 0.19f}, {0.27f, 0.08f, 0.57f},
                                            {0.72f, 0.13f, 0.47f}, {0.94f, 0.42f, 0.14f},
                                            {0.94f, 0.75f, 0.19f}, {0.99f, 0.99f, 0.84f}};
    constexpr int kLast = static_cast<int>(std::size(kColors)) - 1;
    const float place = std::clamp(value, 0.0f, 1.0f) * kLast;
    const int index = std::min(static_cast<int>(place), kLast - 1);
    return glm::mix(kColors[index], kColors[index + 1], place - static_cast<float>(index));
}

}  // namespace packet::tools
