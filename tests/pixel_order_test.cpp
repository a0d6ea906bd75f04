// The order in which an image's rays are traced.
#include "schedule/pixel_order.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

using namespace packet;

namespace {

/// How often each ray is in a tile. The tiles whose last row and line are those of squares, and
/// they alone, are to be whole.
std::vector<int> count_rays(const PixelOrder& order, std::size_t count, const PixelLayout& layout) {
    std::vector<int> times(count, 0);
    for (std::size_t tile = 0; tile < order.tile_count(); ++tile) {
        PixelOrder::Indices indices;
        const PixelTile rays = order.fill(tile, indices);
        const std::size_t tiles = (layout.width + 31) / 32;
        const std::size_t x = tile % tiles * 32, y = tile / tiles * 32;
        const std::size_t width = std::min<std::size_t>(32, layout.width - x);
        const std::size_t lines = std::min<std::size_t>(32, count / layout.width - y);
        const bool is_whole =
            width % 4 == 0 && lines % 4 == 0 && (lines == 32 || count % layout.width == 0);
        CHECK(rays.row_bits == (is_whole ? 2 : 0));
        CHECK((!is_whole || rays.count == width * lines));
        const std::size_t row = std::size_t{1} << rays.row_bits;
        for (std::size_t i = 0; i < rays.count; ++i) {
            const std::size_t ray = order.first_ray(tile) + indices[i / row] + i % row;
            REQUIRE(ray < count);
            ++times[ray];
        }
    }
    return times;
}

}  // namespace

TEST_CASE("an image's tiles hold each of its rays once, whole ones row by row") {
    constexpr std::size_t kCounts[] = {129, 31 * 96 + 40, 3072, 6401, 6400};
    constexpr std::size_t kWidths[] = {1, 4, 31, 32, 33, 36, 64, 96, 100};
    for (const std::size_t width : kWidths) {
        for (const std::size_t count : kCounts) {
            CAPTURE(width);
            CAPTURE(count);
            const PixelLayout layout = PixelLayout::scanlines(width);
            const PixelOrder order(count, layout);
            REQUIRE(order.is_image());
            const std::vector<int> times = count_rays(order, count, layout);
            CHECK(std::ranges::all_of(times, [](int n) { return n == 1; }));
        }
    }
    constexpr std::size_t kSides[] = {4, 8, 16, 32}, kBlocks[] = {1, 2, 3, 5};
    for (const std::size_t block_width : kSides) {
        for (const std::size_t block_height : kSides) {
            for (const std::size_t width : kBlocks) {
                const PixelLayout layout{width * block_width, block_width, block_height};
                const std::size_t count = layout.width * block_height * 11;
                CAPTURE(layout.width);
                CAPTURE(block_width);
                CAPTURE(block_height);
                const std::vector<int> times = count_rays(PixelOrder(count, layout), count, layout);
                CHECK(std::ranges::all_of(times, [](int n) { return n == 1; }));
            }
        }
    }
}

TEST_CASE("what leaves no two lines, or is wider than 32 bits index, is no image") {
    CHECK_FALSE(PixelOrder(100, PixelLayout()).is_image());
    CHECK_FALSE(PixelOrder(100, PixelLayout::scanlines(100)).is_image());
    CHECK(PixelOrder(101, PixelLayout::scanlines(100)).is_image());
    CHECK_FALSE(PixelOrder(std::size_t{1} << 40, PixelLayout::scanlines(1u << 26)).is_image());
}

TEST_CASE("tiles of more rays than 32 bits index count from their first ray") {
    constexpr std::size_t kCount = std::size_t{1} << 33, kWidth = (std::size_t{1} << 25) + 32;
    for (const PixelLayout& layout :
         {PixelLayout::scanlines(kWidth), PixelLayout{kWidth, 32, 32}, PixelLayout{kWidth, 4, 4}}) {
        const std::size_t lines = kCount / kWidth / 32 * 32, count = lines * kWidth;
        const PixelOrder order(count, layout);
        PixelOrder::Indices indices;
        const std::size_t tile = order.tile_count() - 1;
        const PixelTile rays = order.fill(tile, indices);
        REQUIRE(rays.row_bits == 2);
        REQUIRE(rays.count == 1024);
        for (std::size_t line = 0; line < 4; ++line) {
            CHECK(order.first_ray(tile) + indices[line] ==
                  layout.column(kWidth - 32) + layout.row(lines - 32 + line));
        }
        for (std::size_t i = 0; i < 256; ++i) CHECK(order.first_ray(tile) + indices[i] + 3 < count);
        CHECK(order.first_ray(tile) + indices[255] + 3 == count - 1);
    }
}

TEST_CASE("of a tile sixteen rays are a square, and 128 a block of 16 x 8") {
    constexpr std::size_t kWidth = 64;
    for (const PixelLayout& layout :
         {PixelLayout::scanlines(kWidth), PixelLayout{kWidth, 4, 4}, PixelLayout{kWidth, 16, 8}}) {
        std::vector<std::size_t> x_of(kWidth * 64), y_of(kWidth * 64);
        for (std::size_t y = 0; y < 64; ++y) {
            for (std::size_t x = 0; x < kWidth; ++x) {
                x_of[layout.column(x) + layout.row(y)] = x;
                y_of[layout.column(x) + layout.row(y)] = y;
            }
        }
        const PixelOrder order(kWidth * 64, layout);
        PixelOrder::Indices indices;
        for (std::size_t tile = 0; tile < order.tile_count(); ++tile) {
            const PixelTile rays = order.fill(tile, indices);
            REQUIRE(rays.row_bits == 2);
            const auto check = [&](std::size_t count, std::size_t width, std::size_t height) {
                for (std::size_t first = 0; first < rays.count; first += count) {
                    std::vector<std::size_t> x, y;
                    for (std::size_t i = first; i < first + count; ++i) {
                        const std::size_t ray = order.first_ray(tile) + indices[i / 4] + i % 4;
                        x.push_back(x_of[ray]);
                        y.push_back(y_of[ray]);
                    }
                    CHECK(std::ranges::max(x) - std::ranges::min(x) + 1 == width);
                    CHECK(std::ranges::max(y) - std::ranges::min(y) + 1 == height);
                }
            };
            check(16, 4, 4);
            check(128, 16, 8);
        }
    }
}
