// The order in which an image's rays are traced.
#include "schedule/pixel_order.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

using namespace packet;

TEST_CASE("an image's tiles hold each of its rays once, whole ones row by row") {
    constexpr std::size_t kCounts[] = {129, 31 * 96 + 40, 3072, 6401};
    for (const int width : {1, 4, 31, 32, 33, 64, 96, 100}) {
        for (const std::size_t count : kCounts) {
            const PixelOrder order(count, width);
            REQUIRE(order.is_image());
            std::vector<int> times(count, 0);
            std::size_t whole = 0;
            for (std::size_t tile = 0; tile < order.tile_count(); ++tile) {
                PixelOrder::Indices indices;
                const PixelTile rays = order.fill(tile, indices);
                const std::size_t row = std::size_t{1} << rays.row_bits;
                const bool is_whole = rays.row_bits != 0;
                whole += is_whole ? 1 : 0;
                CHECK((!is_whole || (row == 4 && rays.count == indices.size())));
                for (std::size_t i = 0; i < rays.count; ++i) {
                    const std::size_t ray = order.first_ray(tile) + indices[i / row] + i % row;
                    REQUIRE(ray < count);
                    ++times[ray];
                }
            }
            CAPTURE(width);
            CAPTURE(count);
            CHECK(std::ranges::all_of(times, [](int n) { return n == 1; }));
            // A tile is whole if the last of its rays is there.
            const auto line = static_cast<std::size_t>(width);
            std::size_t expected = 0;
            for (std::size_t y = 31; y * line < count; y += 32) {
                for (std::size_t x = 31; x < line; x += 32)
                    expected += y * line + x < count ? 1 : 0;
            }
            CHECK(whole == expected);
        }
    }
}

TEST_CASE("of a tile sixteen rays are a square, and 128 a block of 16 x 8") {
    constexpr std::size_t kWidth = 64;
    const PixelOrder order(kWidth * 64, kWidth);
    PixelOrder::Indices indices;
    for (std::size_t tile = 0; tile < order.tile_count(); ++tile) {
        const PixelTile rays = order.fill(tile, indices);
        REQUIRE(rays.row_bits == 2);
        const auto pixel = [&](std::size_t i) { return indices[i / 4] + i % 4; };
        const auto check = [&](std::size_t count, std::size_t width, std::size_t height) {
            for (std::size_t first = 0; first < rays.count; first += count) {
                std::size_t x[2] = {kWidth, 0}, y[2] = {kWidth, 0};
                for (std::size_t i = first; i < first + count; ++i) {
                    x[0] = std::min(x[0], pixel(i) % kWidth);
                    x[1] = std::max(x[1], pixel(i) % kWidth);
                    y[0] = std::min(y[0], pixel(i) / kWidth);
                    y[1] = std::max(y[1], pixel(i) / kWidth);
                }
                CHECK(x[1] - x[0] + 1 == width);
                CHECK(y[1] - y[0] + 1 == height);
            }
        };
        check(16, 4, 4);
        check(128, 16, 8);
    }
}
