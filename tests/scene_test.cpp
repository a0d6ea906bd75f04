// Scenes: meshes, instances, errors, and what tracing promises about threads and sizes.
#include "generate.h"
#include "oracle.h"
#include "test_rays.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <thread>
#include <utility>

using namespace packet;
using namespace packet::test;

TEST_CASE("a scene that refuses something stays as it was") {
    Scene scene = make_scene(tools::make_sphere(100));
    scene.commit();
    TriangleMesh bad = tools::make_sphere(100);
    bad.triangles[3].z = 100000;
    CHECK_THROWS_AS(scene.add_mesh(bad), Error);
    CHECK_THROWS_AS(scene.add_instance(1), Error);
    CHECK_THROWS_AS(scene.add_instance(0, glm::mat4x3(0.0f)), Error);
    glm::mat4x3 flat(1.0f);
    flat[2] = flat[1];
    CHECK_THROWS_WITH_AS(scene.add_instance(0, flat),
                         "transform of instance 1 is singular: it has no inverse", Error);
    glm::mat4x3 bad_number(1.0f);
    bad_number[3][1] = std::nanf("");
    CHECK_THROWS_WITH_AS(scene.add_instance(0, bad_number),
                         "transform of instance 1 is not finite at row 1, column 3", Error);
    BuildOptions options;
    options.max_leaf_size = 1000;
    CHECK_THROWS_AS(scene.commit(options), Error);
    CHECK(scene.meshes().size() == 1);
    CHECK(scene.instances().size() == 1);
    CHECK(trace_any(scene, Ray{}));
}

TEST_CASE("tracing before commit is an error, as are spans that differ in length") {
    Scene scene = make_scene(tools::make_sphere(100));
    std::vector<Ray> rays(3);
    std::vector<Hit> hits(3);
    CHECK_THROWS_AS(trace_closest(scene, rays, hits), Error);
    CHECK_THROWS_AS((void)trace_closest(scene, Ray{}), Error);
    CHECK_THROWS_AS((void)scene.build_stats(), Error);
    scene.commit();
    CHECK_THROWS_WITH_AS(trace_closest(scene, rays, std::span(hits).first(2)),
                         "3 rays but room for 2 hits", Error);
    TraceOptions options;
    options.threads = -2;
    CHECK_THROWS_AS(trace_closest(scene, rays, hits, options), Error);
    options = {};
    options.width = -2;
    CHECK_THROWS_AS(trace_closest(scene, rays, hits, options), Error);
    trace_closest(scene, {}, {});
}

TEST_CASE("instances answer as the flattened scene does, with ids mapped") {
    tools::Random random(99);
    Scene scene;
    scene.add_mesh(tools::make_sphere(1000));
    scene.add_mesh(tools::make_terrain(2000, 1));
    std::vector<std::uint32_t> first_triangle;
    std::uint32_t triangles = 0;
    for (std::uint32_t i = 0; i < 100; ++i) {
        glm::mat4x3 m;
        for (int column = 0; column < 3; ++column) m[column] = random.direction();
        m[3] = 30.0f * random.point();
        if (i % 3 == 0) m[2] = -m[2];
        if (std::abs(glm::dot(m[0], glm::cross(m[1], m[2]))) < 0.1f) m = glm::mat4x3(1.0f);
        scene.add_instance(i % 2, m);
        first_triangle.push_back(triangles);
        triangles += static_cast<std::uint32_t>(scene.meshes()[i % 2].triangles.size());
    }
    scene.commit();
    const TriangleMesh mesh = scene.flatten();
    Scene flat = make_scene(mesh);
    flat.commit();
    // How far apart points may be that rounding a transform parts, across a triangle's plane.
    const float slack = 1e-6f * glm::length(scene.bounds().extent());
    const auto across = [&](const Ray& ray, std::uint32_t prim_id) {
        const glm::uvec3 t = mesh.triangles[prim_id];
        const glm::vec3 a = mesh.positions[t.x];
        const glm::vec3 normal = glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a);
        return std::abs(glm::dot(ray.dir, glm::normalize(normal)));
    };
    CHECK(scene.triangle_count() == triangles);
    CHECK(flat.triangle_count() == triangles);
    const auto rays = random_rays(scene.bounds(), 100000, 7);
    std::vector<Hit> hits(rays.size()), flat_hits(rays.size());
    trace_closest(scene, rays, hits);
    trace_closest(flat, rays, flat_hits);
    std::size_t hit_count = 0, moved = 0, neighbours = 0, silhouettes = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Hit &a = hits[i], &b = flat_hits[i];
        hit_count += a.is_hit();
        if (a.is_hit() != b.is_hit()) {
            ++silhouettes;
        } else if (a.is_hit()) {
            const bool same = first_triangle[a.instance_id] + a.prim_id == b.prim_id;
            const float apart = std::abs(a.t - b.t);
            const bool near = apart <= 1e-5f * std::max(1.0f, std::abs(b.t)) ||
                              apart * across(rays[i], b.prim_id) <= slack;  // it grazes
            moved += same && !near;
            neighbours += !same && near;
            silhouettes += !same && !near;
        }
    }
    CHECK(hit_count > 4000);
    CHECK(moved == 0);
    // The transforms round, so a ray at an edge may fall to either side of it.
    CHECK(neighbours <= 5);
    CHECK(silhouettes <= 5);
}

TEST_CASE("10,000 instances of a large mesh take under 200 bytes each") {
    Scene scene;
    scene.add_mesh(tools::make_sphere(100000));
    scene.add_instance(0);
    scene.commit();
    const std::size_t one = scene.build_stats().bytes;
    for (int i = 1; i < 10000; ++i) {
        glm::mat4x3 m(1.0f);
        m[3] = 3.0f * glm::vec3(i % 100, i / 100, 0);
        scene.add_instance(0, m);
    }
    scene.commit();
    CHECK((scene.build_stats().bytes - one) / 9999 < 200);
}

TEST_CASE("rays in scanline order give the same hits in the same places with any width") {
    Scene scene = make_scene(tools::make_city(3000, 1));
    scene.commit();
    const auto rays = random_rays(scene.bounds(), 10007, 6);
    std::vector<Hit> want(rays.size()), hits(rays.size());
    trace_closest(scene, rays, want);
    for (const int width : {1, 3, 31, 32, 33, 100, 5000, 10006, 10007, 2000000000}) {
        for (const ModeName& mode : mode_names()) {
            TraceOptions options;
            options.width = width;
            options.mode = mode.mode;
            std::fill(hits.begin(), hits.end(), Hit{});
            trace_closest(scene, rays, hits, options);
            CHECK(hits == want);
            std::vector<std::uint8_t> occluded(rays.size(), 9);
            trace_any(scene, rays, occluded, options);
            for (std::size_t i = 0; i < rays.size(); ++i) REQUIRE(occluded[i] == want[i].is_hit());
        }
    }
}

TEST_CASE(
    "auto gives the hits of single rays, each once, where it tries modes on part of the rays") {
    Scene scene = make_scene(tools::make_city(3000, 1));
    scene.commit();
    const auto rays = random_rays(scene.bounds(), 160001, 6);  // over 128 tasks, in runs and tiles
    std::vector<Hit> want(rays.size()), hits(rays.size());
    TraceOptions options;
    options.mode = Mode::kSingle;
    trace_closest(scene, rays, want, options);
    options.mode = Mode::kAuto;
    for (const int threads : {1, 2}) {
        for (const int width : {0, 401}) {
            options.threads = threads;
            options.width = width;
            TraceStats stats;
            options.stats = &stats;
            std::fill(hits.begin(), hits.end(), Hit{});
            trace_closest(scene, rays, hits, options);
            CHECK(hits == want);
            CHECK(stats.rays == rays.size());
            options.stats = nullptr;
            std::vector<std::uint8_t> occluded(rays.size(), 9);
            trace_any(scene, rays, occluded, options);
            std::size_t different = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                different += occluded[i] != want[i].is_hit();
            }
            CHECK(different == 0);
        }
    }
}

TEST_CASE("an image traced by tiles visits every pixel once and gives the hits of its rays") {
    Scene scene = make_scene(tools::make_sphere(1000));
    scene.commit();
    constexpr int kWidth = 101, kHeight = 67;
    std::vector<int> visits(kWidth * kHeight);
    std::vector<Hit> hits(visits.size());
    const auto ray_at = [](int x, int y) {
        return aim({0.1f, 0.2f, 3.0f}, {static_cast<float>(x) / kWidth - 0.5f,
                                        static_cast<float>(y) / kHeight - 0.5f, 0});
    };
    TraceStats stats;
    TraceOptions options;
    options.stats = &stats;
    trace_tiles(
        scene, kWidth, kHeight,
        [&](Tile tile, std::span<Ray> rays) {
            std::size_t i = 0;
            for (int y = tile.y0; y < tile.y1; ++y) {
                for (int x = tile.x0; x < tile.x1; ++x) rays[i++] = ray_at(x, y);
            }
        },
        [&](Tile tile, std::span<const Ray>, std::span<const Hit> tile_hits) {
            std::size_t i = 0;
            for (int y = tile.y0; y < tile.y1; ++y) {
                for (int x = tile.x0; x < tile.x1; ++x) {
                    const auto pixel = static_cast<std::size_t>(y * kWidth + x);
                    ++visits[pixel];
                    hits[pixel] = tile_hits[i++];
                }
            }
        },
        options);
    for (std::size_t i = 0; i < visits.size(); ++i) {
        REQUIRE(visits[i] == 1);
        REQUIRE(hits[i] == trace_closest(scene, ray_at(static_cast<int>(i) % kWidth,
                                                       static_cast<int>(i) / kWidth)));
    }
    CHECK(stats.rays == visits.size());
    CHECK_THROWS_AS(trace_tiles(scene, 0, 5, {}, {}), Error);
    CHECK_THROWS_WITH(
        trace_tiles(scene, 64, 64, [](Tile, std::span<Ray>) { throw std::runtime_error("mine"); },
                    {}),
        "mine");
}

TEST_CASE("statistics count work, and counting changes no hit") {
    Scene scene = make_scene(tools::make_sphere(1000));
    scene.commit();
    const auto rays = random_rays(scene.bounds(), 5000, 6);
    std::vector<Hit> want(rays.size());
    trace_closest(scene, rays, want);
    for (const ModeName& mode : mode_names()) {
        TraceStats stats;
        TraceOptions options;
        options.mode = mode.mode;
        options.stats = &stats;
        std::vector<Hit> hits(rays.size());
        trace_closest(scene, rays, hits, options);
        CHECK(hits == want);
        CHECK(stats.rays == rays.size());
        CHECK(stats.nodes_per_ray() > 1.0);
        CHECK(stats.triangles_per_ray() > 0.1);
        CHECK(stats.lane_utilization() > 0.0);
        CHECK(stats.lane_utilization() <= 1.0);
        if (mode.mode == Mode::kSingle) CHECK(stats.lane_utilization() == 1.0);
    }
}

TEST_CASE("shadow rays go by streams, and where most meet the same by packets, with one answer") {
    // 128 x 128 rays from a plane through the terrain to one light above it
    const auto rays_over = [](const Bounds3f& box) {
        constexpr int kSide = 128;
        const glm::vec3 light = box.lower + glm::vec3(0.4f, 3.0f, 0.3f) * box.extent();
        std::vector<Ray> rays;
        for (int i = 0; i < kSide * kSide; ++i) {
            const int row = i / kSide, column = i % kSide;
            const glm::vec3 place(static_cast<float>(column) / kSide, 0.5f,
                                  static_cast<float>(row) / kSide);
            rays.push_back(aim(box.lower + place * box.extent(), light));
            rays.back().tfar = 1.0f;
        }
        return rays;
    };
    const auto trace = [](const Scene& scene, std::span<const Ray> rays, Mode mode, IsaId isa) {
        std::vector<std::uint8_t> occluded(rays.size());
        TraceStats stats;
        TraceOptions options;
        options.mode = mode, options.isa = isa, options.threads = 1, options.stats = &stats;
        trace_any(scene, rays, occluded, options);
        return std::pair(occluded, stats.lane_utilization());
    };
    for (const bool is_fine : {false, true}) {
        Scene scene = make_scene(tools::make_terrain(is_fine ? 200000 : 200, 3));
        scene.commit();
        const auto rays = rays_over(scene.bounds());
        for (const IsaId isa : built_isas()) {
            if (!cpu_supports(isa)) continue;
            CAPTURE(to_string(isa));
            const auto want = trace(scene, rays, Mode::kSingle, isa).first;
            CHECK(std::ranges::count(want, 1) > 1000);
            CHECK(std::ranges::count(want, 0) > 1000);
            const auto [by_auto, auto_lanes] = trace(scene, rays, Mode::kAuto, isa);
            const auto [by_tiles, tile_lanes] = trace(scene, rays, Mode::kTile, isa);
            CHECK(by_auto == want);
            CHECK(by_tiles == want);
            // Where streams go by packets some lanes are idle, but far fewer than in tiles. Where
            // leaves are nearer to each other than rays are, there are none of these.
            CHECK(auto_lanes < 1.0);
            if (is_fine) {
                CHECK(tile_lanes == auto_lanes);
            } else {
                CHECK(1.0 - auto_lanes < 0.3 * (1.0 - tile_lanes));
            }
        }
    }
}

TEST_CASE("tasks that are traced to try packets keep their answers") {
    constexpr std::size_t kCount = 70'000;  // more than 128 tasks of 512 rays
    for (const AccelKind accel : {AccelKind::kBvh, AccelKind::kGrid}) {
        Scene scene;
        const std::uint32_t city = scene.add_mesh(tools::make_city(2000, 1));
        for (int i = 0; i < 2; ++i) {  // of one instance there would be streams, and no tries
            glm::mat4x3 placed(1.0f);
            placed[3].y = 0.1f * static_cast<float>(i);
            scene.add_instance(city, placed);
        }
        BuildOptions build;
        build.accel = accel;
        scene.commit(build);
        std::vector<Ray> rays = random_rays(scene.bounds(), kCount, 4);
        // Trees: alike, so that packets are tried beside tiles. A grid: beside single rays.
        if (accel == AccelKind::kBvh) {
            const Bounds3f box = scene.bounds();
            for (std::size_t i = 0; i < kCount; ++i) {
                const float part = static_cast<float>(i) / static_cast<float>(kCount);
                rays[i] =
                    aim(box.upper, box.lower + glm::vec3(part, 0.0f, 1.0f - part) * box.extent());
            }
        }
        std::vector<Hit> want(kCount), got(kCount);
        TraceOptions options;
        options.mode = Mode::kSingle;
        trace_closest(scene, rays, want, options);
        options.mode = Mode::kAuto;
        for (options.threads = 1; options.threads <= 2; ++options.threads) {
            std::ranges::fill(got, Hit{});
            trace_closest(scene, rays, got, options);
            CHECK(got == want);
        }
    }
}

TEST_CASE("one committed scene may be traced from many threads at once") {
    Scene scene = make_scene(tools::make_city(5000, 1));
    scene.commit();
    const auto rays = random_rays(scene.bounds(), 20000, 8);
    std::vector<Hit> want(rays.size());
    trace_closest(scene, rays, want);
    std::vector<std::vector<Hit>> hits(4, std::vector<Hit>(rays.size()));
    std::vector<std::thread> threads;
    for (auto& mine : hits) {
        threads.emplace_back([&] {
            Scene copy = scene;
            trace_closest(scene, rays, mine);
            copy.commit();
            trace_closest(copy, rays, mine);
        });
    }
    for (std::thread& thread : threads) thread.join();
    for (const auto& mine : hits) CHECK(mine == want);
}

TEST_CASE("names: every one is found, unknown ones list the valid") {
    for (const ModeName& mode : mode_names()) CHECK(parse_mode(to_string(mode.mode)) == mode.mode);
    for (const AccelName& a : accel_names()) CHECK(parse_accel(to_string(a.kind)) == a.kind);
    for (const IsaId isa : built_isas()) CHECK(parse_isa(to_string(isa)) == isa);
    CHECK_THROWS_WITH_AS((void)parse_isa("avx9"),
                         "unknown instruction set 'avx9'; valid are: scalar, sse42, avx2, avx512",
                         Error);
    CHECK_THROWS_AS((void)parse_mode(""), Error);
    CHECK_THROWS_AS((void)parse_accel("BVH"), Error);
}

TEST_CASE("PACKET_ISA forces an instruction set; a wrong one is an error that lists the valid") {
    const char* before = std::getenv("PACKET_ISA");
    const std::string kept = before != nullptr ? before : "";
    ::setenv("PACKET_ISA", "scalar", 1);
    CHECK(default_isa() == IsaId::kScalar);
    ::setenv("PACKET_ISA", "pentium", 1);
    CHECK_THROWS_WITH_AS(
        (void)default_isa(),
        "unknown instruction set in PACKET_ISA 'pentium'; valid are: scalar, sse42, "
        "avx2, avx512",
        Error);
    ::setenv("PACKET_ISA", kept.c_str(), 1);
    CHECK(cpu_supports(default_isa()));
}
