// What rays of which nobody says that they are an image's are taken for.
#include "schedule/pixel_layout.h"
#include "random.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace packet;

namespace {

const Bounds3f kWorld{glm::vec3(-1.0f), glm::vec3(1.0f)};

struct Camera {
    bool is_parallel = false;
    float jitter = 0.0f;  ///< in pixels
    float slope = 1.0f;   ///< half of the view's longer side at distance 1
};

std::vector<Ray> image(std::size_t width, std::size_t height, const PixelLayout& layout,
                       const Camera& camera = {}) {
    tools::Random random(7);
    std::vector<Ray> rays(width * height);
    const float scale = 2.0f * camera.slope / static_cast<float>(std::max(width, height));
    for (std::size_t y = 0; y < height; ++y) {
        for (std::size_t x = 0; x < width; ++x) {
            const float column = static_cast<float>(x) + camera.jitter * random.uniform();
            const float line = static_cast<float>(y) + camera.jitter * random.uniform();
            const glm::vec3 place(scale * (column - 0.5f * static_cast<float>(width)),
                                  scale * (0.5f * static_cast<float>(height) - line), 0.0f);
            Ray& ray = rays[layout.column(x) + layout.row(y)];
            ray.org = glm::vec3(0.1f, 0.2f, 3.0f) + (camera.is_parallel ? place : glm::vec3(0.0f));
            ray.dir = glm::vec3(0.0f, 0.0f, -1.0f) + (camera.is_parallel ? glm::vec3(0) : place);
        }
    }
    return rays;
}

constexpr Camera kCameras[] = {{}, {.slope = 0.1f}, {.is_parallel = true}, {.jitter = 1.0f}};

PixelLayout scanlines(std::size_t width) { return PixelLayout::scanlines(width); }

}  // namespace

TEST_CASE("scanlines show where lines end") {
    struct Size {
        std::size_t width, height;
    };
    for (const Camera& camera : kCameras) {
        for (const Size& size : {Size{32, 33}, Size{65, 64}, Size{100, 80}, Size{101, 77},
                                 Size{640, 33}, Size{33, 640}}) {
            CAPTURE(size.width);
            CAPTURE(camera.jitter);
            const PixelLayout layout = scanlines(size.width);
            auto rays = image(size.width, size.height, layout, camera);
            CHECK(find_layout(rays, kWorld) == layout);
            rays.resize(rays.size() - 10);  // the last line is short
            CHECK(find_layout(rays, kWorld) == layout);
        }
    }
}

TEST_CASE("so do blocks of pixels") {
    constexpr std::size_t kSides[] = {4, 8, 16, 32}, kBlocks[] = {2, 3, 16};
    for (const Camera& camera : kCameras) {
        for (const std::size_t width : kSides) {
            for (const std::size_t height : kSides) {
                // 4 jittered pixels make no line that can be told from a few more
                if (camera.jitter != 0.0f && (width == 4 || height == 4)) continue;
                for (const std::size_t blocks : kBlocks) {
                    const PixelLayout layout{blocks * width, width, height};
                    const std::size_t lines = 32 / height + 1;  // a line is a 32nd at most
                    if (blocks * width * height * lines < 1024) continue;
                    const auto rays = image(layout.width, lines * height, layout, camera);
                    CAPTURE(width);
                    CAPTURE(height);
                    CAPTURE(blocks);
                    CAPTURE(camera.is_parallel);
                    CHECK(find_layout(rays, kWorld) == layout);
                }
            }
        }
    }
}

TEST_CASE("other blocks are images as wide as they are, if they do not fill one as well") {
    CHECK(find_layout(image(256, 128, {256, 64, 64}), kWorld) == scanlines(64));
    CHECK(find_layout(image(120, 120, {120, 12, 12}), kWorld) == scanlines(12));
    auto rays = image(128, 128, {128, 16, 16});
    rays.resize(rays.size() - 100);
    CHECK(find_layout(rays, kWorld) == scanlines(16));
    rays = image(128, 128, {128, 4, 4});
    rays.resize(rays.size() - 100);
    CHECK_FALSE(find_layout(rays, kWorld).is_image());
}

TEST_CASE("an image that is a line of blocks, or one whose lines never turn, has no blocks") {
    CHECK(find_layout(image(32, 32, {32, 32, 32}), kWorld) == scanlines(32));
    CHECK_FALSE(find_layout(image(4096, 4, {4096, 4, 4}), kWorld).is_image());
    // All around: lines go on where they began.
    constexpr std::size_t kWidth = 256;
    constexpr PixelLayout kBlocks{kWidth, 4, 4};
    std::vector<Ray> rays(kWidth * 64);
    for (std::size_t y = 0; y < 64; ++y) {
        for (std::size_t x = 0; x < kWidth; ++x) {
            const float turn = 6.2831853f * static_cast<float>(x) / kWidth;
            Ray& ray = rays[kBlocks.column(x) + kBlocks.row(y)];
            ray.org = glm::vec3(0.0f);
            ray.dir = {std::cos(turn), 0.0245f * (static_cast<float>(y) - 32.0f), std::sin(turn)};
        }
    }
    CHECK_FALSE(find_layout(rays, kWorld).is_image());
    // Where a block begins are no rays.
    rays = image(128, 128, {128, 4, 4});
    for (std::size_t i = 16; i < rays.size(); i += 16) rays[i].dir = glm::vec3(0.0f);
    CHECK_FALSE(find_layout(rays, kWorld).is_image());
}

TEST_CASE("pixels along a Morton curve are as near as can be, and no image's lines") {
    for (const Camera& camera : kCameras) {
        for (const std::size_t side : {std::size_t{32}, std::size_t{64}, std::size_t{256}}) {
            for (const bool y_first : {false, true}) {
                const auto scanned = image(side, side, scanlines(side), camera);
                std::vector<Ray> rays(side * side);
                for (std::size_t i = 0; i < rays.size(); ++i) {
                    std::size_t at[2] = {0, 0};
                    for (std::size_t bit = 0; bit < 16; ++bit)
                        at[bit % 2] |= (i >> bit & 1) << bit / 2;
                    rays[i] = scanned[at[y_first ? 1 : 0] + at[y_first ? 0 : 1] * side];
                }
                CAPTURE(side);
                CAPTURE(camera.jitter);
                CHECK_FALSE(find_layout(rays, kWorld).is_image());
            }
        }
    }
}

TEST_CASE("what shows no image is none") {
    const auto is_image = [](const std::vector<Ray>& rays) {
        return find_layout(rays, kWorld).is_image();
    };
    CHECK(is_image(image(64, 64, scanlines(64))));
    CHECK_FALSE(is_image({}));
    CHECK_FALSE(is_image(image(31, 33, scanlines(31))));      // too few
    CHECK_FALSE(is_image(image(1024, 31, scanlines(1024))));  // lines are too long
    auto rays = image(128, 128, scanlines(128));
    for (std::uint32_t seed = 0; seed < 20; ++seed) {
        std::ranges::shuffle(rays, std::mt19937(seed));
        CAPTURE(seed);
        CHECK_FALSE(is_image(rays));
    }
    // Pieces of lines, as long as they please: the first looks like a line, and none is below it.
    const auto pixels = image(128, 128, scanlines(128));
    tools::Random random(3);
    for (int turn = 0; turn < 20; ++turn) {
        CAPTURE(turn);
        rays.clear();
        while (rays.size() < pixels.size()) {
            const auto first =
                static_cast<std::size_t>(random.uniform() * static_cast<float>(pixels.size() - 64));
            const auto length = static_cast<std::size_t>(10.0f + 40.0f * random.uniform());
            rays.insert(rays.end(), pixels.begin() + static_cast<std::ptrdiff_t>(first),
                        pixels.begin() + static_cast<std::ptrdiff_t>(first + length));
        }
        CHECK_FALSE(is_image(rays));
    }
    std::ranges::fill(rays, rays[0]);
    CHECK_FALSE(is_image(rays));
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 0.0f}) {
        for (Ray& ray : rays) ray.dir = glm::vec3(bad);
        CHECK_FALSE(is_image(rays));
    }
    rays = image(64, 64, scanlines(64));
    for (Ray& ray : rays) ray.org.x = std::numeric_limits<float>::infinity();
    CHECK_FALSE(is_image(rays));
    // The first are a block, others end nowhere or are no rays.
    rays = image(128, 128, {128, 4, 4});
    for (std::size_t i = 16; i < rays.size(); ++i) rays[i] = rays[i % 16];
    CHECK_FALSE(is_image(rays));
    for (std::size_t i = 16; i < rays.size(); ++i) rays[i].dir = glm::vec3(0.0f);
    CHECK_FALSE(is_image(rays));
    // Some that are no rays do not hide the others' layout, nor are read beyond.
    rays = image(128, 128, scanlines(128));
    for (std::size_t i = 300; i < rays.size(); i += 37) rays[i].dir = glm::vec3(0.0f);
    CHECK(find_layout(rays, kWorld) == scanlines(128));
}
