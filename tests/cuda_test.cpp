// Tracing on the device: every hit of every mode is the CPU's, to the bit. Compiled twice: for the
// device there is, and for one that is emulated on the CPU.
#include "configurations.h"
#include "cuda_device.h"
#include "generate.h"
#include "test_rays.h"
#include "walkable.h"

#include <doctest/doctest.h>

#include <cstring>

using namespace packet;
using namespace packet::test;
using cuda::DeviceMode;
using cuda::DeviceScene;

TEST_SUITE_BEGIN("cuda");

namespace {

constexpr DeviceMode kModes[] = {DeviceMode::kWarp, DeviceMode::kThread, DeviceMode::kSorted};

void check_mode(const DeviceScene& device, std::span<const Ray> rays, std::span<const Hit> want,
                const cuda::DeviceTraceOptions& options) {
    INFO(cuda::to_string(options.mode) << ", width " << options.width);
    std::vector<Hit> hits(rays.size());
    device.trace_closest(rays, hits, options);
    CHECK(count_differences(rays, want, hits) == 0);

    std::vector<std::uint8_t> occluded(rays.size(), 7);
    device.trace_any(rays, occluded, options);
    std::size_t different = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) different += occluded[i] != want[i].is_hit();
    CHECK(different == 0);
}

/// All modes, in each order of the threads, against the CPU.
void check_device(const Scene& scene, std::span<const Ray> rays, const std::string& label) {
    INFO(label);
    std::vector<Hit> want(rays.size());
    trace_closest(scene, rays, want);
    const DeviceScene device(scene);
    for (int order = 0; order < kThreadOrders; ++order) {
        set_thread_order(order);
        INFO("order " << order);
        for (const DeviceMode mode : kModes) check_mode(device, rays, want, {mode, 0, nullptr});
    }
    check_mode(device, rays, want, {DeviceMode::kWarp, 37, nullptr});
}

bool is_grid(AccelKind kind) { return kind == AccelKind::kGrid || kind == AccelKind::kGridOfTrees; }

}  // namespace

TEST_CASE("every generated scene, in every tree, as the CPU") {
    if (!has_device()) return;
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        Scene scene = make_scene(kind.make(500, 3));
        const auto rays = random_rays(scene.bounds(), 300, 17);
        for (const Build& build : all_builds()) {
            if (is_grid(build.options.accel)) continue;
            scene.commit(build.options);
            check_device(scene, rays, std::string(kind.name) + " " + build.name);
        }
    }
}

TEST_CASE("a scene of instances, some of one mesh") {
    if (!has_device()) return;
    Scene scene;
    const std::uint32_t sphere = scene.add_mesh(tools::make_sphere(200));
    const std::uint32_t soup = scene.add_mesh(tools::make_soup(60, 5));
    const std::uint32_t empty = scene.add_mesh({});
    tools::Random random(3);
    for (int i = 0; i < 40; ++i) {
        glm::mat4x3 placed(0.2f + random.uniform());
        placed[1][0] = random.uniform();
        placed[3] = 6.0f * random.point();
        scene.add_instance(i % 3 == 0 ? soup : sphere, placed);
        if (i % 10 == 0) scene.add_instance(sphere, placed);  // twice at one place: ids decide
        if (i % 20 == 0) scene.add_instance(empty, placed);
    }
    commit_for_devices(scene);
    check_device(scene, random_rays(scene.bounds(), 1000, 29), "instances");
}

TEST_CASE("a scene that is built on the device") {
    if (!has_device()) return;
    Scene scene;
    const std::uint32_t city = scene.add_mesh(tools::make_city(800, 3));
    const std::uint32_t soup = scene.add_mesh(tools::make_soup(60, 5));
    const std::uint32_t empty = scene.add_mesh({});
    for (const std::uint32_t mesh : {city, soup, empty, soup}) {
        glm::mat4x3 placed(1.0f + 0.3f * static_cast<float>(mesh));
        placed[3] = glm::vec3(0.7f * static_cast<float>(scene.instances().size()));
        scene.add_instance(mesh, placed);
    }
    const std::vector<Ray> rays = random_rays(scene.bounds(), 500, 31);
    Scene committed = scene;
    committed.commit();
    std::vector<Hit> want(rays.size());
    trace_closest(committed, rays, want);
    for (const AccelKind kind : {AccelKind::kBvhMorton, AccelKind::kKdSah}) {
        BuildOptions options;
        options.accel = kind;
        INFO(to_string(kind));
        const DeviceScene device(scene, options);
        for (const DeviceMode mode : kModes) check_mode(device, rays, want, {mode, 0, nullptr});
    }
    for (const AccelKind kind : {AccelKind::kBvh, AccelKind::kGrid}) {
        BuildOptions options;
        options.accel = kind;
        CHECK_THROWS_WITH((DeviceScene{scene, options}),
                          ("CUDA devices build bvh-morton and breadth-first kd-sah, not " +
                           std::string(to_string(kind)))
                              .c_str());
    }
}

TEST_CASE("rays at features, rays without sense, no rays, no triangles") {
    if (!has_device()) return;
    const TriangleMesh grid =
        make_grid(6, 6, {-1, -1, 0.5f}, {0.3f, 0.01f, 0}, {-0.02f, 0.3f, 0.1f});
    Scene scene = make_scene(grid);
    commit_for_devices(scene);
    std::vector<Ray> rays = aim_at_features({0.1f, 0.3f, -3.7f}, grid.view());
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    for (const float bad : {nan, inf, -inf, 0.0f, -0.0f, 1e38f, 1e-40f}) {
        for (int field = 0; field < 8; ++field) {
            Ray ray = rays[static_cast<std::size_t>(field)];
            std::memcpy(reinterpret_cast<char*>(&ray) + 4 * field, &bad, sizeof(bad));
            rays.push_back(ray);
        }
    }
    check_device(scene, rays, "features");
    check_device(scene, {}, "no rays");
    Scene nothing = make_scene({});
    commit_for_devices(nothing);
    check_device(nothing, rays, "no triangles");
    Scene none;
    commit_for_devices(none);
    check_device(none, rays, "no instances");
}

TEST_CASE("work is counted as the CPU counts it") {
    if (!has_device()) return;
    Scene scene = make_scene(tools::make_terrain(2000, 3));
    commit_for_devices(scene);
    const auto rays = random_rays(scene.bounds(), 640, 5);
    std::vector<Hit> hits(rays.size());
    const DeviceScene device(scene);
    for (const DeviceMode mode : kModes) {
        TraceStats stats;
        device.trace_closest(rays, hits, {mode, 0, &stats});
        CHECK(stats.rays == rays.size());
        CHECK(stats.nodes > rays.size());
        CHECK(stats.triangles > 0);
        CHECK(stats.lanes_active == stats.nodes);
        CHECK(stats.lanes_issued % 32 == 0);
        CHECK(stats.lane_utilization() > 0.05);
        CHECK(stats.lane_utilization() <= 1.0);
    }
}

TEST_CASE("what is not walked on devices is refused by name") {
    const Node node = {};
    const GridBrick brick = {};
    TreeView tree;
    CHECK_NOTHROW(cuda::require_walkable(tree, 0));  // empty
    tree.node_count = 1;
    CHECK_THROWS_WITH(cuda::require_walkable(tree, 3),
                      "mesh 3 has no binary nodes, which CUDA devices walk: build with "
                      "BuildOptions::keep_binary_nodes");
    tree.nodes = &node;
    CHECK_NOTHROW(cuda::require_walkable(tree, 3));
    tree.grid.bricks = &brick;
    CHECK_THROWS_WITH(cuda::require_walkable(tree, 4),
                      "mesh 4 is in a grid, which CUDA devices do not walk: choose a tree");
}

TEST_CASE("errors of the device's interface") {
    if (!has_device()) return;
    Scene scene = make_scene(tools::make_sphere(32));
    CHECK_THROWS_AS(DeviceScene{scene}, Error);  // not committed
    commit_for_devices(scene);
    const DeviceScene device(scene);
    const std::vector<Ray> rays(3);
    std::vector<Hit> hits(2);
    CHECK_THROWS_WITH(device.trace_closest(rays, hits), "3 rays but room for 2 hits");
    hits.resize(3);
    CHECK_THROWS_AS(device.trace_closest(rays, hits, {DeviceMode::kAuto, -1, nullptr}), Error);
    BuildOptions options;
    options.accel = AccelKind::kGrid;
    scene.commit(options);
    CHECK_THROWS_WITH(DeviceScene{scene},
                      "mesh 0 is in a grid, which CUDA devices do not walk: choose a tree");
    scene.commit();
    CHECK_THROWS_WITH(DeviceScene{scene},
                      "mesh 0 has no binary nodes, which CUDA devices walk: build with "
                      "BuildOptions::keep_binary_nodes");
    CHECK_THROWS_WITH((void)cuda::parse_device_mode("warps"),
                      "unknown device mode 'warps'; valid are: auto, warp, thread, sorted");
}
