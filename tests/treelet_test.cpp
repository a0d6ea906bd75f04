// Trees are cut into treelets as asked, and rays that wait for them meet what they should, however
// little memory there is to wait in.
#include "build/treelets.h"
#include "build/validate_tree.h"
#include "configurations.h"
#include "generate.h"
#include "schedule/treelet_order.h"
#include "schedule/treelet_queues.h"
#include "schedule/treelet_sweep.h"
#include "test_rays.h"

#include <packet/packet.h>

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <optional>
#include <set>
#include <stdexcept>

using namespace packet;
using namespace packet::test;

namespace {

constexpr TreeletCut kCuts[] = {TreeletCut::kAreas, TreeletCut::kSubtrees};

Tree tree_of(MeshView mesh, TreeletCut cut, std::size_t bytes, int threads = 1) {
    BuildOptions options;
    options.treelet_cut = cut;
    options.treelet_bytes = bytes;
    options.threads = threads;
    return build_tree(mesh, options);
}

Scene scene_of(const TriangleMesh& mesh, std::size_t treelet_bytes,
               TreeletCut cut = TreeletCut::kAreas) {
    Scene scene = make_scene(mesh);
    BuildOptions options;
    options.treelet_bytes = treelet_bytes;
    options.treelet_cut = cut;
    scene.commit(options);
    return scene;
}

TraceOptions by_treelets(int threads = 1) {
    TraceOptions options;
    options.mode = Mode::kTreelet;
    options.threads = threads;
    return options;
}

/// Traces both queries and returns how many answers differ from `want`.
std::size_t count_wrong(const Scene& scene, std::span<const Ray> rays, std::span<const Hit> want,
                        const TraceOptions& options) {
    std::vector<Hit> hits(rays.size(), Hit{.t = -1.0f, .u = 0, .v = 0, .prim_id = 7});
    trace_closest(scene, rays, hits, options);
    std::vector<std::uint8_t> occluded(rays.size(), 7);
    trace_any(scene, rays, occluded, options);
    std::size_t wrong = count_differences(rays, want, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) wrong += occluded[i] != want[i].is_hit();
    return wrong;
}

}  // namespace

TEST_SUITE_BEGIN("treelets");

TEST_CASE("treelets are no larger than asked, and not far too many") {
    const TriangleMesh mesh = tools::make_city(20000, 1);
    for (const TreeletCut cut : kCuts) {
        std::size_t last = 0xFFFFFFFF;
        for (const std::size_t bytes : {10000u, 100000u, 1000000u, 100000000u}) {
            const Tree tree = tree_of(mesh.view(), cut, bytes);
            validate(tree, mesh.view(), AccelKind::kBvh);
            const TreeletStats& stats = tree.stats.treelets;
            CHECK(stats.most_bytes <= bytes);
            CHECK(stats.count < last);
            CHECK(stats.count * bytes >= stats.bytes);
            CHECK(stats.cut_edges + 1 == stats.count);
            CHECK(stats.count < 30 * (1 + stats.bytes / bytes));
            last = stats.count;
        }
        CHECK(last == 1);
    }
}

TEST_CASE("one node may be larger, and is a treelet of its own") {
    const TriangleMesh mesh = tools::make_sphere(2000);
    for (const TreeletCut cut : kCuts) {
        const Tree tree = tree_of(mesh.view(), cut, 1);
        validate(tree, mesh.view(), AccelKind::kBvh);
        CHECK(tree.stats.treelets.count == tree.wide_nodes.size());
    }
    CHECK(tree_of(mesh.view(), TreeletCut::kAreas, 0).treelets.begin.empty());
}

TEST_CASE("cut by areas, fewer entries are expected than cut by subtrees") {
    const TriangleMesh mesh = tools::make_terrain(20000, 1);
    const Tree areas = tree_of(mesh.view(), TreeletCut::kAreas, 50000);
    const Tree subtrees = tree_of(mesh.view(), TreeletCut::kSubtrees, 50000);
    CHECK(areas.stats.treelets.expected_entries >= 1.0);
    CHECK(areas.stats.treelets.expected_entries < subtrees.stats.treelets.expected_entries);
    const Tree one = tree_of(mesh.view(), TreeletCut::kAreas, 100000000);
    CHECK(one.stats.treelets.expected_entries == 1.0);
}

TEST_CASE("rays meet the same whatever the treelets' size, memory, chunk, threads and cut") {
    const std::pair<TriangleMesh, std::size_t> cases[] = {{tools::make_hairball(3000, 2), 3000},
                                                          {tools::make_city(3000, 2), 6000},
                                                          {tools::make_soup(500, 2), 3000}};
    for (const auto& [mesh, count] : cases) {
        const Scene plain = make_scene(mesh);
        const auto rays = random_rays(plain.bounds(), count, 4);
        const std::vector<Hit> want = Oracle(plain).closest(rays);
        for (const TreeletCut cut : kCuts) {
            for (const std::size_t treelet_bytes : {1u, 3000u, 40000u, 10000000u}) {
                const Scene scene = scene_of(mesh, treelet_bytes, cut);
                for (const std::size_t queue_bytes : {0u, 16u, 4000u, 50000u, 100000000u}) {
                    for (const int chunk : {1, 5, 256}) {
                        TraceOptions options = by_treelets(1 + chunk % 3);
                        options.queue_bytes = queue_bytes;
                        options.queue_chunk = chunk;
                        CAPTURE(treelet_bytes);
                        CAPTURE(queue_bytes);
                        CAPTURE(chunk);
                        CHECK(count_wrong(scene, rays, want, options) == 0);
                    }
                }
            }
        }
    }
}

TEST_CASE("any number of rays, more than start together") {
    const TriangleMesh mesh = tools::make_terrain(2000, 3);
    const Scene scene = scene_of(mesh, 5000);
    const auto all = random_rays(scene.bounds(), 100000, 5);
    TraceOptions single;
    single.mode = Mode::kSingle;
    std::vector<Hit> want(all.size());
    trace_closest(scene, all, want, single);
    for (const std::size_t count : {0u, 1u, 63u, 65u, 32768u, 32769u, 100000u}) {
        for (const int threads : {1, 2, 3}) {
            CAPTURE(count);
            CHECK(count_wrong(scene, std::span(all).first(count), std::span(want).first(count),
                              by_treelets(threads)) == 0);
        }
    }
}

TEST_CASE("what rays and treelets have in common is counted") {
    const TriangleMesh mesh = tools::make_hairball(20000, 2);
    const Scene scene = scene_of(mesh, 20000);
    const auto rays = random_rays(scene.bounds(), 50000, 6);
    std::vector<Hit> hits(rays.size());
    const auto count = [&](std::size_t queue_bytes) {
        TraceStats stats;
        TraceOptions options = by_treelets();
        options.stats = &stats;
        options.queue_bytes = queue_bytes;
        trace_closest(scene, rays, hits, options);
        CHECK(stats.rays == rays.size());
        CHECK(stats.nodes >= stats.treelets.entries - rays.size());
        return stats.treelets;
    };
    const TreeletTraceStats much = count(100'000'000);
    CHECK(much.entries > 2 * rays.size());
    CHECK(much.loads > 10);
    CHECK(much.rays_per_load() > 50.0);
    CHECK(much.treelet_bytes > much.loads * 256);
    CHECK(much.treelet_bytes <= much.loads * 20000);
    // All entries but the first of a ray are written and read, and so are those that are left out.
    CHECK(much.queue_bytes > 2 * sizeof(QueuedRay) * (much.entries - rays.size()));
    CHECK(much.queue_bytes < 4 * sizeof(QueuedRay) * (much.entries - rays.size()));
    CHECK(much.peak_queued > 10000);
    CHECK(much.peak_queued < much.queue_bytes / (2 * sizeof(QueuedRay)));
    // Each treelet once a sweep, and all rays sweep together.
    CHECK(much.loads < scene.build_stats().treelets.count);
    CHECK(much.stream_utilization() > 0.05);
    CHECK(much.stream_utilization() <= 1.0);

    const TreeletTraceStats little = count(100'000);
    CHECK(little.peak_queued <= 100'000 / sizeof(QueuedRay));
    CHECK(little.peak_queued > 0);
    CHECK(little.entries < much.entries);  // rays go on without waiting
    const TreeletTraceStats none = count(0);
    CHECK(none.entries == rays.size());
    CHECK(none.loads == 0);
}

TEST_CASE("scenes that are not one tree, or not cut, are traced all the same") {
    const TriangleMesh mesh = tools::make_sphere(500);
    const auto rays = random_rays(make_scene(mesh).bounds(), 2000, 7);
    const std::vector<Hit> want = Oracle(make_scene(mesh)).closest(rays);
    TraceStats stats;
    TraceOptions options = by_treelets();
    options.stats = &stats;
    CHECK(count_wrong(scene_of(mesh, 0), rays, want, options) == 0);
    CHECK(stats.treelets.entries == 0);
    CHECK(count_wrong(scene_of(mesh, 1000), rays, want, options) == 0);
    CHECK(stats.treelets.entries != 0);
}

TEST_CASE("auto sweeps for closest-hit where the tree is beyond the cache and rays pay for it") {
    constexpr std::size_t kMega = 1'000'000;
    CHECK(sweeps_beat_streams(kMega, 170 * kMega, 200.0, 1));
    CHECK(sweeps_beat_streams(kMega, 170 * kMega, 200.0, 2));
    CHECK(!sweeps_beat_streams(kMega, 170 * kMega, 50.0, 1));
    CHECK(!sweeps_beat_streams(kMega, 170 * kMega, 200.0, 64));
    CHECK(!sweeps_beat_streams(kMega, 5 * kMega, 200.0, 1));
    CHECK(!sweeps_beat_streams(kMega, 10'000 * kMega, 200.0, 1));
    // More than are sorted together make no sweep longer.
    CHECK(!sweeps_beat_streams(100 * kMega, 10'000 * kMega, 200.0, 1));

    const TriangleMesh mesh = tools::make_hairball(600'000, 1);
    const auto sweeps = [&](std::optional<std::size_t> treelet_bytes, std::size_t count,
                            bool scattered = true) {
        Scene scene = make_scene(mesh);
        BuildOptions build;
        build.treelet_bytes = treelet_bytes;
        scene.commit(build);
        const Bounds3f world = scene.bounds();
        auto rays = random_rays(world, count, 9);
        if (!scattered) {
            for (Ray& ray : rays) ray.org = world.center();
        }
        TraceOptions options;
        options.threads = 2;
        options.mode = Mode::kStream;
        std::vector<Hit> want(count), hits(count);
        trace_closest(scene, rays, want, options);
        TraceStats closest, any;
        options.mode = Mode::kAuto;
        options.stats = &closest;
        trace_closest(scene, rays, hits, options);
        CHECK(count_differences(rays, want, hits) == 0);
        std::vector<std::uint8_t> occluded(count);
        options.stats = &any;
        trace_any(scene, rays, occluded, options);
        std::size_t wrong = 0;
        for (std::size_t i = 0; i < count; ++i) wrong += occluded[i] != want[i].is_hit();
        CHECK(wrong == 0);
        CHECK(any.treelets.entries == 0);
        return closest.treelets.entries != 0;
    };
    CHECK(sweeps(std::nullopt, 200'000));
    CHECK(!sweeps(std::nullopt, 200'000, false));
    CHECK(!sweeps(std::nullopt, 100'000));
    CHECK(!sweeps(0, 200'000));
    BuildOptions fast;
    fast.accel = AccelKind::kBvhMorton;
    CHECK(build_tree(mesh.view(), fast).treelets.begin.empty());
    const TriangleMesh terrain = tools::make_terrain(900'000, 1);
    CHECK(build_tree(terrain.view(), {}).treelets.begin.empty());
}

TEST_CASE("options out of range are refused") {
    const Scene scene = scene_of(tools::make_sphere(100), 1000);
    for (const int chunk : {-1, 0, 65537}) {
        TraceOptions options = by_treelets();
        options.queue_chunk = chunk;
        CHECK_THROWS_AS(trace_closest(scene, {}, {}, options), Error);
    }
}

TEST_CASE("a pool hands out all of its memory, once, in order, and takes it back") {
    constexpr std::uint32_t kChunk = 4, kTreelets = 3;
    TreeletQueuePool pool(10 * kChunk * sizeof(QueuedRay) + 1, kChunk, kTreelets);
    for (int round = 0; round < 3; ++round) {
        CHECK(pool.waiting_in_all() == 0);
        std::set<std::uint32_t> used;
        const auto put = [&](std::uint32_t treelet, std::uint32_t ray) {
            QueueTail& tail = pool.tails[treelet];
            if (tail.next == tail.end && !pool.add_chunk(pool, treelet)) return false;
            CHECK(used.insert(tail.next).second);
            pool.slots[tail.next++] = {ray, 1.0f};
            return true;
        };
        for (std::uint32_t i = 0; i < 9; ++i) CHECK(put(1, i));
        for (std::uint32_t i = 0; i < 5; ++i) CHECK(put(2, 100 + i));
        CHECK(pool.waiting(1) == 9);
        CHECK(pool.waiting(2) == 5);
        CHECK(pool.waiting_in_all() == 14);
        std::uint32_t more = 0;
        while (put(0, more)) ++more;
        CHECK(more == 20);  // five of ten chunks

        for (const auto& [treelet, first, count] :
             {std::array{0u, 0u, 20u}, std::array{1u, 0u, 9u}, std::array{2u, 100u, 5u}}) {
            std::uint32_t next = first;
            for (auto rays = pool.front(treelet); !rays.empty(); rays = pool.front(treelet)) {
                for (const QueuedRay& ray : rays) CHECK(ray.ray == next++);
                pool.pop(treelet);
            }
            CHECK(next == first + count);
            CHECK(pool.waiting(treelet) == 0);
        }
    }
}

TEST_CASE("treelets come after the one above them, of siblings the nearest first") {
    const Tree tree = tree_of(tools::make_city(20000, 1).view(), TreeletCut::kAreas, 10000);
    const TreeView view = tree.view();
    for (const glm::vec3 way : {glm::vec3(1, 0, 0), glm::vec3(-2, 5, 1), glm::vec3(0)}) {
        const std::vector<std::uint32_t> order = treelet_order(view, way);
        REQUIRE(order.size() == view.treelet_count);
        std::vector<std::size_t> place(order.size(), order.size());
        for (std::size_t i = 0; i < order.size(); ++i) place[order[i]] = i;
        CHECK(order[0] == 0);
        const auto distance = [&](std::uint32_t t) {
            const float* centre = view.treelet_roots[t].centre;
            return glm::dot(way, glm::vec3(centre[0], centre[1], centre[2]));
        };
        std::size_t siblings = 0;
        for (std::uint32_t t = 1; t < view.treelet_count; ++t) {
            const std::uint32_t parent = view.treelet_roots[t].parent;
            REQUIRE(place[t] < order.size());
            CHECK(place[parent] < place[t]);
            for (std::uint32_t other = t + 1; other < view.treelet_count; ++other) {
                if (view.treelet_roots[other].parent != parent) continue;
                ++siblings;
                if (distance(t) < distance(other)) CHECK(place[t] < place[other]);
                if (distance(t) > distance(other)) CHECK(place[t] > place[other]);
            }
        }
        CHECK(siblings > 100);
    }
}

TEST_CASE("sweeps are as long as fetching the tree is worth, and as many as threads have use for") {
    CHECK(rays_per_sweep(1, 1, 1) == 1);
    CHECK(rays_per_sweep(1'000'000, 1'000'000, 1) == 125'000);
    CHECK(rays_per_sweep(1'000'000, 170'000'000, 1) == 250'000);
    CHECK(rays_per_sweep(1'000'000, 170'000'000, 2) == 250'000);
    CHECK(rays_per_sweep(1'000'000, 170'000'000, 8) == 125'000);
    CHECK(rays_per_sweep(1'000'000, 10'000'000'000, 1) == 1'000'000);
    CHECK(rays_per_sweep(1'000'000, 10'000'000'000, 3) == 333'334);
}

TEST_CASE("tracing tells of its progress and can be cancelled, in every mode") {
    const Scene scene = scene_of(tools::make_city(5000, 1), 5000);
    const auto rays = random_rays(scene.bounds(), 70000, 8);
    for (const ModeName& mode : mode_names()) {
        for (const int threads : {1, 2}) {
            CAPTURE(mode.name);
            TraceOptions options = by_treelets(threads);
            options.mode = mode.mode;
            std::vector<Hit> hits(rays.size());
            std::vector<float> told;
            options.progress = [&](float fraction) {
                told.push_back(fraction);
                return true;
            };
            trace_closest(scene, rays, hits, options);
            CHECK(told.front() == 0.0f);
            CHECK(told.back() == 1.0f);
            CHECK(std::is_sorted(told.begin(), told.end()));
            CHECK(told.size() > 3);
            int calls = 0;
            options.progress = [&](float) { return ++calls < 3; };
            CHECK_THROWS_WITH_AS(trace_closest(scene, rays, hits, options), "tracing was cancelled",
                                 Error);
            CHECK(calls == 3);
            options.progress = [](float) -> bool { throw std::runtime_error("mine"); };
            CHECK_THROWS_AS(trace_closest(scene, rays, hits, options), std::runtime_error);
        }
    }
}

TEST_SUITE_END();
