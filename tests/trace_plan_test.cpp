// By what kernel rays are traced, by what they look like and by what there is to hit.
#include "schedule/trace_plan.h"
#include "configurations.h"
#include "random.h"
#include "test_rays.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <utility>

using namespace packet;
using namespace packet::test;

namespace {

constexpr std::size_t kMany = 4096;

Scene scene_of(TriangleMesh mesh, AccelKind accel = AccelKind::kBvh, int instances = 1) {
    Scene scene;
    const std::uint32_t id = scene.add_mesh(std::move(mesh));
    for (int i = 0; i < instances; ++i) scene.add_instance(id, glm::mat4x3(1.0f));
    BuildOptions options;
    options.accel = accel;
    scene.commit(options);
    return scene;
}

/// In the unit square of the plane z = 0, of 2 n^2 triangles.
Scene square_of(int n, AccelKind accel = AccelKind::kBvh, int instances = 1) {
    const float side = 1.0f / static_cast<float>(n);
    return scene_of(make_grid(n, n, glm::vec3(0), {side, 0, 0}, {0, side, 0}), accel, instances);
}

/// Downwards from `height` above the middle of the square: from origins up to `apart` from each
/// other along each axis, and with slopes that differ by as much as `angle`.
std::vector<Ray> rays_down(float height, float apart, float angle, std::size_t count = kMany) {
    tools::Random random(1);
    std::vector<Ray> rays(count);
    for (Ray& ray : rays) {
        ray.org = glm::vec3(0.5f, 0.5f, height) + apart * (random.point() - 0.5f);
        ray.dir =
            glm::vec3(angle * (random.uniform() - 0.5f), angle * (random.uniform() - 0.5f), -1.0f);
    }
    return rays;
}

TracePlan plan(const Scene& scene, std::span<const Ray> rays,
               TraceQuery query = TraceQuery::kClosest, Mode mode = Mode::kAuto) {
    TraceOptions options;
    options.mode = mode;
    return make_plan(scene.accel(), rays, query, options, 1);
}

/// Of a camera above the square's middle that looks down through the pixel (x_middle, y_middle);
/// pixels are 1 / `scale` apart at distance 1.
std::vector<Ray> image_rays(const PixelLayout& layout, std::size_t height, float x_middle,
                            float y_middle, float scale) {
    std::vector<Ray> rays(layout.width * height);
    for (std::size_t y = 0; y < height; ++y) {
        for (std::size_t x = 0; x < layout.width; ++x) {
            Ray& ray = rays[layout.column(x) + layout.row(y)];
            ray.org = glm::vec3(0.43f, 0.57f, 0.3f);
            ray.dir = glm::vec3((static_cast<float>(x) - x_middle) / scale,
                                (static_cast<float>(y) - y_middle) / scale, -1.0f);
        }
    }
    return rays;
}

/// Rays that go by tiles, but those of any-hit where there are streams, against the oracle.
void check_tiles(const Scene& scene, const std::vector<Ray>& rays, TraceOptions options) {
    const auto kernel = [&](TraceQuery query) {
        return make_plan(scene.accel(), rays, query, options, 1).kernel;
    };
    REQUIRE(kernel(TraceQuery::kClosest) == KernelTable::kTile);
    REQUIRE((scene.accel().view.is_single_mesh || kernel(TraceQuery::kAny) == KernelTable::kTile));
    const std::vector<Hit> want = Oracle(scene).closest(rays);
    for (const IsaId isa : cpu_isas()) {
        for (const int threads : {1, 2}) {
            CAPTURE(to_string(isa));
            CAPTURE(threads);
            options.isa = isa;
            options.threads = threads;
            std::vector<Hit> got(rays.size());
            trace_closest(scene, rays, got, options);
            CHECK(got == want);
            std::vector<std::uint8_t> occluded(rays.size(), 7);
            trace_any(scene, rays, occluded, options);
            CHECK(std::ranges::equal(occluded, want, {}, {}, &Hit::is_hit));
        }
    }
}

}  // namespace

TEST_CASE("rays that cohere go by tiles where leaves are large, and by streams where small") {
    const Scene coarse = square_of(8), fine = square_of(256);
    struct Case {
        float height, apart, angle;
        bool tiles_if_coarse, tiles_if_fine;
    };
    for (const Case& c : {Case{0.1f, 0.0f, 0.0f, true, true},        //
                          Case{0.1f, 0.001f, 0.0f, true, true},      //
                          Case{0.1f, 0.04f, 0.0f, true, false},      // over four leaves of the fine
                          Case{0.1f, 0.3f, 0.0f, false, false},      // start apart
                          Case{0.1f, 0.0f, 0.01f, true, true},       //
                          Case{0.3f, 0.0f, 0.15f, true, false},      //
                          Case{0.1f, 0.0f, 0.8f, false, false},      // go apart
                          Case{10.0f, 0.0f, 0.01f, true, false}}) {  // come apart on the way
        CAPTURE(c.height);
        CAPTURE(c.apart);
        CAPTURE(c.angle);
        const std::vector<Ray> rays = rays_down(c.height, c.apart, c.angle);
        for (const Mode mode : {Mode::kAuto, Mode::kTile}) {
            CAPTURE(to_string(mode));
            const auto expected = [](bool tiles) {
                return tiles ? KernelTable::kTile : KernelTable::kStream;
            };
            CHECK(plan(coarse, rays, TraceQuery::kClosest, mode).kernel ==
                  expected(c.tiles_if_coarse));
            CHECK(plan(fine, rays, TraceQuery::kClosest, mode).kernel == expected(c.tiles_if_fine));
        }
    }
}

TEST_CASE("rays of an image are near each other, whether it is said or shows") {
    constexpr int kSide = 64;
    std::vector<Ray> rays;
    for (int row = 0; row < kSide; ++row) {
        for (int column = 0; column < kSide; ++column) {
            const glm::vec3 place = glm::vec3(column, row, 0) / static_cast<float>(kSide);
            Ray ray;
            ray.org = glm::vec3(0.5f, 0.5f, 1.0f);
            ray.dir = place - glm::vec3(0.5f, 0.5f, 3.0f);
            rays.push_back(ray);
        }
    }
    // Of lines that are more than a 32nd of all rays nobody knows that they are an image's.
    const auto strip = std::span(rays).first(std::size_t{kSide} * kSide / 4);
    const Scene coarse = square_of(8), middling = square_of(64), fine = square_of(512);
    for (const Mode mode : {Mode::kAuto, Mode::kTile}) {
        for (const int width : {0, kSide}) {
            CAPTURE(to_string(mode));
            CAPTURE(width);
            TraceOptions options;
            options.mode = mode;
            options.width = width;
            const auto plan_of = [&](const Scene& scene, std::span<const Ray> some) {
                return make_plan(scene.accel(), some, TraceQuery::kClosest, options, 1);
            };
            CHECK(plan_of(coarse, rays).kernel == KernelTable::kTile);
            CHECK(plan_of(coarse, rays).image == PixelLayout::scanlines(kSide));
            CHECK(plan_of(middling, rays).kernel == KernelTable::kTile);
            CHECK(plan_of(fine, rays).kernel == KernelTable::kStream);
            CHECK(plan_of(coarse, strip).kernel == KernelTable::kTile);
            CHECK(plan_of(coarse, strip).image.is_image() == (width != 0));
            CHECK(plan_of(middling, strip).kernel ==
                  (width != 0 ? KernelTable::kTile : KernelTable::kStream));
        }
    }
}

TEST_CASE("whether they share leaves or not, rays hit what the oracle says") {
    const Scene fine = square_of(256);
    for (const bool are_near : {true, false}) {
        CAPTURE(are_near);
        const std::vector<Ray> rays = rays_down(0.1f, are_near ? 0.001f : 0.04f, 0.01f, 1024);
        REQUIRE(plan(fine, rays).kernel == (are_near ? KernelTable::kTile : KernelTable::kStream));
        std::vector<Hit> got(rays.size());
        trace_closest(fine, rays, got);
        CHECK(got == Oracle(fine).closest(rays));
    }
}

TEST_CASE("where an image's tiles go into several octants, rays hit what the oracle says") {
    // The octants' borders lie within blocks of 16 x 8, of whole tiles and of those at the edge.
    constexpr std::size_t kWidth = 72, kHeight = 64;
    const Scene one = square_of(12), two = square_of(12, AccelKind::kBvh, 2);
    for (const auto& [x, y] : {std::pair(27.3f, 29.7f), std::pair(69.2f, 12.6f)}) {
        const auto rays = image_rays(PixelLayout::scanlines(kWidth), kHeight, x, y, 80.0f);
        TraceOptions options;
        options.width = kWidth;
        check_tiles(one, rays, options);
        check_tiles(two, rays, options);
    }
}

TEST_CASE("an image goes by tiles in blocks as in scanlines, be they long or short") {
    const Scene scene = square_of(512);
    const auto kernel = [&](const PixelLayout& layout, float scale) {
        const float middle = 0.5f * static_cast<float>(layout.width);
        return plan(scene, image_rays(layout, 200, middle, 100.0f, scale)).kernel;
    };
    int tiles = 0, streams = 0;
    for (float scale = 45.0f; scale < 160.0f; scale *= 1.05f) {
        CAPTURE(scale);
        const KernelTable::Kernel want = kernel(PixelLayout::scanlines(200), scale);
        ++(want == KernelTable::kTile ? tiles : streams);
        CHECK(kernel({200, 4, 4}, scale) == want);
        CHECK(kernel({200, 8, 4}, scale) == want);
        CHECK(kernel({200, 4, 8}, scale) == want);
        CHECK(kernel({200, 8, 8}, scale) == want);
        // In the middle of the image pixels are farther apart, but not by so much.
        if (want == KernelTable::kTile) {
            CHECK(kernel(PixelLayout::scanlines(12), 1.3f * scale) == KernelTable::kTile);
        }
    }
    CHECK(tiles != 0);
    CHECK(streams != 0);
}

TEST_CASE("in whatever layout an image's rays come, they hit what the oracle says") {
    struct Image {
        PixelLayout layout;
        std::size_t height;
    };
    const Scene one = square_of(12), two = square_of(12, AccelKind::kBvh, 2);
    for (const Image& image :
         {Image{PixelLayout::scanlines(100), 73}, Image{{72, 4, 4}, 76}, Image{{72, 8, 8}, 104},
          Image{{80, 16, 32}, 96}, Image{{96, 32, 16}, 80}}) {
        CAPTURE(image.layout.block_width);
        const float middle = 0.4f * static_cast<float>(image.layout.width);
        const auto rays = image_rays(image.layout, image.height, middle, 29.7f, 80.0f);
        REQUIRE(plan(one, rays).image == image.layout);
        check_tiles(one, rays, {});
        check_tiles(two, rays, {});
    }
}

TEST_CASE("of images whose tiles are enough to try packets, too") {
    // At the lower and right edge tiles are 8 and 12 pixels wide and high.
    const Scene two = square_of(2, AccelKind::kBvh, 2);
    const PixelLayout layout{360, 4, 4};
    const auto rays = image_rays(layout, 396, 170.0f, 180.0f, 400.0f);
    REQUIRE(plan(two, rays).image == layout);
    REQUIRE(plan(two, rays).packets_below > 0.0);
    check_tiles(two, rays, {});
}

TEST_CASE("any-hit rays go by streams, sorted by task, whether they cohere or not") {
    const Scene scene = square_of(8);
    for (const float apart : {0.0f, 0.04f, 1.0f}) {
        CAPTURE(apart);
        const TracePlan of = plan(scene, rays_down(0.1f, apart, 0.0f), TraceQuery::kAny);
        CHECK(of.kernel == KernelTable::kStream);
        CHECK(of.sorting == Sorting::kByTask);
    }
}

TEST_CASE("where there are no streams rays that cohere go by tiles, and packets are tried") {
    const std::vector<Ray> rays = rays_down(0.1f, 0.04f, 0.0f), apart = rays_down(0.1f, 1.0f, 0.0f);
    for (const Scene& scene : {square_of(64, AccelKind::kGrid), square_of(64, AccelKind::kBvh, 2),
                               square_of(64, AccelKind::kGridOfTrees)}) {
        CHECK(plan(scene, rays).kernel == KernelTable::kTile);
        CHECK(plan(scene, rays).packets_below > 0.0);
        CHECK(plan(scene, apart).kernel == KernelTable::kSingle);
        CHECK(plan(scene, apart).packets_below > 0.0);
    }
}

TEST_CASE("few rays are not worth sorting") {
    const Scene fine = square_of(256);
    CHECK(plan(fine, rays_down(0.1f, 0.0f, 0.0f, 64)).kernel == KernelTable::kTile);
    CHECK(plan(fine, rays_down(0.1f, 0.04f, 0.0f, 512)).kernel == KernelTable::kTile);
    CHECK(plan(fine, rays_down(0.1f, 0.3f, 0.0f, 64)).kernel == KernelTable::kSingle);
    CHECK(plan(fine, rays_down(0.1f, 0.0f, 0.0f, 7)).kernel == KernelTable::kSingle);
    CHECK(plan(fine, {}).kernel == KernelTable::kSingle);
}

TEST_CASE("rays of no numbers do not cohere") {
    std::vector<Ray> rays = rays_down(0.1f, 0.0f, 0.0f);
    for (Ray& ray : rays) ray.dir.x = std::numeric_limits<float>::quiet_NaN();
    CHECK(plan(square_of(8), rays).kernel == KernelTable::kStream);
    for (Ray& ray : rays) ray.dir = glm::vec3(0.0f);
    CHECK(plan(square_of(8), rays).kernel == KernelTable::kStream);
}
