// What streams rely on: all rays once, each class in one run, neighbours near each other.
#include "schedule/stream_order.h"
#include "configurations.h"
#include "core/direction_class.h"
#include "dispatch/dispatch.h"
#include "generate.h"
#include "test_rays.h"

#include <packet/packet.h>

#include <doctest/doctest.h>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

using namespace packet;
using namespace packet::test;

namespace {

// Tasks are sorted in four pieces, the last ones of which may be shorter, or empty.
constexpr std::size_t kCounts[] = {
    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 777, 4097, StreamOrder::kMostRays - 1, StreamOrder::kMostRays};

int class_of(const Ray& ray) { return direction_class(ray.dir.x, ray.dir.y, ray.dir.z); }

KernelTable::StreamKeys default_keys() { return select_kernels({}).stream_keys; }

std::vector<std::uint32_t> order_of(std::span<const Ray> rays, int threads) {
    std::vector<std::uint32_t> out(rays.size());
    sort_many(rays, default_keys(), out, 0, Parallel(threads));
    return out;
}

/// A ray's key, as core/stream_key.h says.
std::uint32_t key_of(const Ray& ray, const OriginCells& cells) {
    std::uint32_t place = 0;
    for (int a = 0; a < 3; ++a) {
        const float along = (ray.org[a] - cells.lower[a]) * cells.scale;
        const float inside = along > 0 ? std::min(along, kOriginCells - 1.0f) : 0.0f;  // NaN: 0
        const auto cell = static_cast<std::uint32_t>(inside);
        for (int bit = 0; bit < kOriginCellBits; ++bit) {
            place |= (cell >> bit & 1u) << (3 * bit + 2 - a);
        }
    }
    const int of_class = class_of(ray);
    return static_cast<std::uint32_t>(of_class / 3 * 4 + of_class % 3) << kStreamPlaceBits | place;
}
std::vector<std::uint32_t> keys_of(std::span<const Ray> rays) {
    const OriginCells cells = find_origin_cells(rays);
    std::vector<std::uint32_t> out;
    for (const Ray& ray : rays) out.push_back(key_of(ray, cells));
    return out;
}
/// The indices of rays by key, and of equal ones in the order in which they come.
std::vector<std::uint32_t> expected_order(std::span<const Ray> rays) {
    const std::vector<std::uint32_t> keys = keys_of(rays);
    std::vector<std::uint32_t> out(rays.size());
    std::iota(out.begin(), out.end(), 0u);
    std::ranges::stable_sort(out, {}, [&](auto i) { return keys[i]; });
    return out;
}

/// Rays as neighbouring pixels have them: most go as the one before, from next to it.
std::vector<Ray> runs_of_rays(const Bounds3f& world, std::size_t count, std::size_t longest) {
    std::vector<Ray> out = random_rays(world, count, 7);
    for (std::size_t first = 0, length = 1; first < count; first += length) {
        length = std::min(1 + first * 7 % longest, count - first);
        std::fill_n(out.begin() + static_cast<std::ptrdiff_t>(first), length, out[first]);
    }
    return out;
}

/// Scattered rays get their own hits, by streams and as `auto` chooses.
void check_scattered_rays(const Scene& scene) {
    const std::vector<Ray> rays = random_rays(scene.bounds(), 9 * StreamOrder::kMostRays + 7, 9);
    std::vector<Hit> want(rays.size()), got(rays.size());
    std::vector<std::uint8_t> occluded(rays.size());
    TraceOptions options;
    options.mode = Mode::kSingle;
    trace_closest(scene, rays, want, options);
    for (const Mode mode : {Mode::kStream, Mode::kAuto}) {
        options.mode = mode;
        for (options.threads = 1; options.threads <= 2; ++options.threads) {
            std::ranges::fill(got, Hit{});
            trace_closest(scene, rays, got, options);
            CHECK(got == want);
            std::ranges::fill(occluded, std::uint8_t{2});
            trace_any(scene, rays, occluded, options);
            CHECK(std::ranges::equal(
                occluded, want, {}, [](auto o) { return o != 0; },
                [](const Hit& hit) { return hit.is_hit(); }));
        }
    }
}

}  // namespace

TEST_SUITE_BEGIN("stream order");

TEST_CASE("a direction's class is its octant and longest axis") {
    CHECK(direction_class(1, 2, 3) == 2);
    CHECK(direction_class(-1, 2, 3) == 5);
    CHECK(direction_class(1, -3, 2) == 7);
    CHECK(direction_class(4, 3, -4) == 12);
    // 1 / -0 is negative, so the ray meets upper planes first
    CHECK(direction_class(-0.0f, 1, 0) == 4);
    CHECK(direction_class(0.0f, 1, -0.0f) == 13);
    CHECK(direction_class(-0.0f, -0.0f, -0.0f) == 21);
}

TEST_CASE("keys are the same by every instruction set") {
    const float inf = INFINITY, nan = std::nanf("");
    std::vector<Ray> rays = random_rays({{-1, -2, -3}, {4, 1, 2}}, 203, 5);
    const std::size_t scattered = rays.size();
    for (const float x : {-inf, -1e38f, -0.0f, 0.0f, 1e-40f, 1.0f, 1e38f, inf, nan}) {
        for (const float y : {-1.0f, -0.0f, 0.0f, 1.0f, nan}) {
            rays.push_back({.org = {x, y, 1}, .dir = {y, 1, x}});
            rays.push_back({.org = {y, x, x}, .dir = {x, y, -1}});
        }
    }
    const OriginCells cells = find_origin_cells(std::span(rays).first(scattered));
    // The last one's planes lie where rays start.
    for (const OriginCells& by : {cells, OriginCells{}, OriginCells{{-7, -2, -1}, 1.0f}}) {
        for (const IsaId isa : cpu_isas()) {
            for (const std::size_t count :
                 {std::size_t{1}, std::size_t{7}, std::size_t{8}, std::size_t{9}, rays.size()}) {
                std::vector<std::uint32_t> keys(count + 1, 123);
                select_kernels(isa).stream_keys(rays.data(), count, by, keys.data());
                std::size_t wrong = 0;
                for (std::size_t i = 0; i < count; ++i) {
                    const glm::vec3& dir = rays[i].dir;
                    // Rays that hit nothing may have any key.
                    if (glm::any(glm::isnan(dir))) continue;
                    wrong += keys[i] != key_of(rays[i], by) ? 1 : 0;
                }
                CHECK(wrong == 0);
                CHECK(keys[count] == 123);
            }
        }
    }
}

TEST_CASE("rays are sorted by class, then by origin") {
    const Bounds3f world{{-1, -2, -3}, {4, 1, 2}};
    StreamOrder order;
    for (const std::size_t count : kCounts) {
        const std::vector<Ray> rays = random_rays(world, count, 5);
        const auto sorted = order.sort(rays, default_keys());
        CHECK(std::ranges::is_sorted(sorted, {}, [&](auto i) { return class_of(rays[i]); }));
        CHECK(std::ranges::equal(sorted, expected_order(rays)));
    }
    CHECK(order.sort({}, default_keys()).empty());
}

TEST_CASE("runs of rays are sorted as single ones are") {
    const Bounds3f world{{-1, -2, -3}, {4, 1, 2}};
    StreamOrder order;
    for (const std::size_t count : kCounts) {
        // Shorter ones than pay, just about as long, and longer than are written at a time.
        for (const std::size_t longest : {3u, 8u, 15u, 70u, 20'000u}) {
            const std::vector<Ray> rays = runs_of_rays(world, count, longest);
            CHECK(std::ranges::equal(order.sort(rays, default_keys()), expected_order(rays)));
        }
    }
}

TEST_CASE("many rays are sorted as few are, by any number of threads") {
    const Bounds3f world{{-1, -2, -3}, {4, 1, 2}};
    for (const std::size_t count : kCounts) {
        const std::vector<Ray> rays = random_rays(world, count, 5);
        StreamOrder order;
        for (const int threads : {1, 2}) {
            CHECK(std::ranges::equal(order_of(rays, threads), order.sort(rays, default_keys())));
        }
    }
    const std::vector<Ray> rays = random_rays(world, 200'000, 5);
    std::vector<std::uint32_t> all = order_of(rays, 2), want(rays.size());
    CHECK(all == order_of(rays, 1));
    CHECK(std::ranges::is_sorted(all, {}, [&](auto i) { return class_of(rays[i]); }));
    std::ranges::sort(all);
    std::iota(want.begin(), want.end(), 0u);
    CHECK(all == want);
}

TEST_CASE("scattered rays, sorted together or, where the tree costs less, by task") {
    constexpr double kLeastCostTogether = 28.0;  // of schedule/trace_plan.cpp
    Scene cheap = make_scene(tools::make_city(500, 3));
    cheap.commit();
    REQUIRE(cheap.build_stats().sah_cost < kLeastCostTogether);
    check_scattered_rays(cheap);
    Scene costly = make_scene(tools::make_soup(3000, 3));
    costly.commit();
    REQUIRE(costly.build_stats().sah_cost > kLeastCostTogether);
    check_scattered_rays(costly);
}

TEST_CASE("streams that take steps in turn find the same") {
    const Scene scene = [] {
        Scene out = make_scene(tools::make_city(200'000, 3));
        out.commit();
        return out;
    }();
    const std::vector<Ray> all = random_rays(scene.bounds(), 20'001, 9);
    // No ray, fewer streams than take turns, and streams that begin while others go on.
    for (const std::size_t count : {std::size_t{0}, std::size_t{5}, std::size_t{300}, all.size()}) {
        const std::span<const Ray> rays = std::span(all).first(count);
        std::vector<Hit> want(count);
        TraceOptions single;
        single.mode = Mode::kSingle;
        trace_closest(scene, rays, want, single);
        for (const Configuration& by : all_configurations(AccelKind::kBvh)) {
            if (by.mode != Mode::kStream) continue;
            CAPTURE(by.name());
            std::vector<Hit> got(count);
            trace_closest(scene, rays, got, by.trace_options());
            CHECK(count_differences(rays, want, got) == 0);
            std::vector<std::uint8_t> occluded(count, 2);
            trace_any(scene, rays, occluded, by.trace_options());
            CHECK(std::ranges::equal(
                occluded, want, {}, [](auto o) { return o != 0; },
                [](const Hit& hit) { return hit.is_hit(); }));
        }
    }
}

TEST_CASE("rays that follow each other start near each other") {
    const Bounds3f world{{0, 0, 0}, {1, 1, 1}};
    std::vector<Ray> rays = random_rays(world, StreamOrder::kMostRays, 6);
    for (Ray& ray : rays) ray.dir = {0, 0, 1};
    StreamOrder order;
    const auto sorted = order.sort(rays, default_keys());
    float way = 0, sorted_way = 0;
    for (std::size_t i = 1; i < rays.size(); ++i) {
        way += glm::distance(rays[i].org, rays[i - 1].org);
        sorted_way += glm::distance(rays[sorted[i]].org, rays[sorted[i - 1]].org);
    }
    CHECK(sorted_way < 0.25f * way);
}

TEST_CASE("origins that are no points, far away, or all the same") {
    const float inf = INFINITY, nan = std::nanf("");
    const std::vector<std::vector<float>> rows = {
        {inf, -inf, nan, 1e38f, -1e38f, 0.5f}, {nan, nan}, {1e-40f, 0.0f, 2e-40f}, {7, 7, 7, 7}};
    for (const std::vector<float>& row : rows) {
        std::vector<Ray> rays(64);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            rays[i].org = {row[i % row.size()], 0, row[i % row.size()]};
        }
        StreamOrder order;
        std::vector<std::uint32_t> all(rays.size()), want(rays.size());
        std::ranges::copy(order.sort(rays, default_keys()), all.begin());
        std::ranges::sort(all);
        std::iota(want.begin(), want.end(), 0u);
        CHECK(all == want);
    }
}

TEST_SUITE_END();
