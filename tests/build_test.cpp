// Structures: what any of them must hold, whatever the triangles.
#include "generate.h"
#include "test_rays.h"

#include "build/tree.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

using namespace packet;
using namespace packet::test;

namespace {

struct Walked {
    std::vector<int> seen;  ///< how often each triangle is in a leaf
    int depth = 0;
    std::size_t nodes = 0;
};

Bounds3f box_of(const Node& node) {
    return {{node.plane[0][0], node.plane[0][1], node.plane[0][2]},
            {node.plane[1][0], node.plane[1][1], node.plane[1][2]}};
}

/// Visits the whole tree; checks that boxes contain their children and triangles.
void walk(const Tree& tree, std::uint32_t id, int depth, Walked& out) {
    REQUIRE(id < tree.nodes.size());
    REQUIRE(out.nodes++ < tree.nodes.size());  // a cycle would pass this
    const Node& node = tree.nodes[id];
    const Bounds3f box = box_of(node);
    out.depth = std::max(out.depth, depth);
    if (!node.is_leaf()) {
        for (const std::uint32_t child : {id + 1, node.link}) {
            REQUIRE(child > id);
            CHECK(box.contains(box_of(tree.nodes[child])));
            walk(tree, child, depth + 1, out);
        }
        return;
    }
    for (std::uint32_t i = node.link; i < node.link + node.count; ++i) {
        const TriangleBlock& block = tree.blocks.at(i / kBlockSize);
        const std::uint32_t lane = i % kBlockSize;
        ++out.seen.at(static_cast<std::size_t>(block.prim_id[lane]));
        for (const auto& corner : block.v) {
            const glm::vec3 p(corner[0][lane], corner[1][lane], corner[2][lane]);
            CHECK(box.contains({p, p}));
        }
    }
}

Walked check_tree(const TriangleMesh& mesh, const BuildOptions& options = {}) {
    const Tree tree = build_tree(mesh.view(), options);
    Walked out;
    out.seen.assign(mesh.triangles.size(), 0);
    if (!tree.nodes.empty()) walk(tree, 0, 0, out);
    CHECK(out.nodes == tree.nodes.size());
    CHECK(out.nodes == tree.stats.node_count);
    CHECK(out.depth == tree.stats.depth);
    CHECK(out.depth <= kMaxDepth);
    std::size_t reachable = 0;
    for (const int times : out.seen) reachable += times > 0;
    CHECK(reachable + tree.stats.skipped.total() == mesh.triangles.size());
    return out;
}

std::vector<unsigned char> bytes_of(const Tree& tree) {
    const std::size_t node_bytes = tree.nodes.size() * sizeof(Node);
    const std::size_t block_bytes = tree.blocks.size() * sizeof(TriangleBlock);
    std::vector<unsigned char> out(node_bytes + block_bytes);
    std::memcpy(out.data(), tree.nodes.data(), node_bytes);
    std::memcpy(out.data() + node_bytes, tree.blocks.data(), block_bytes);
    return out;
}

}  // namespace

TEST_CASE("a tree holds every triangle once, in boxes that contain it") {
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        for (const std::size_t count : {1u, 2u, 3u, 10u, 1000u, 30000u}) {
            CAPTURE(kind.name);
            CAPTURE(count);
            for (const int times : check_tree(kind.make(count, 1)).seen) CHECK(times == 1);
        }
    }
}

TEST_CASE("a mesh without triangles, or none that can be hit, is empty and hits nothing") {
    TriangleMesh empty;
    TriangleMesh degenerate;
    degenerate.positions = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
    degenerate.triangles = {{0, 1, 2}, {0, 0, 1}, {1, 1, 1}};
    for (const TriangleMesh& mesh : {empty, degenerate}) {
        check_tree(mesh);
        Scene scene = make_scene(mesh);
        scene.commit();
        CHECK(scene.build_stats().node_count == 0);
        CHECK(!trace_closest(scene, Ray{}).is_hit());
        CHECK(!trace_any(scene, Ray{}));
    }
    Scene nothing;
    nothing.commit();
    CHECK(!trace_closest(nothing, Ray{}).is_hit());
}

TEST_CASE("triangles that can never be hit are skipped and counted by reason") {
    const float nan = std::nanf("");
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0},     {1, 0, 0},        {0, 1, 0}, {nan, 0, 0},
                      {0, 3e18f, 0}, {0, 0, INFINITY}, {2, 0, 0}, {0.1f, 0.2f, 0.3f}};
    mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {0, 1, 5}, {0, 1, 6}, {7, 7, 2}, {3, 4, 5}};
    const Tree tree = build_tree(mesh.view(), {});
    CHECK(tree.stats.skipped.non_finite == 3);
    CHECK(tree.stats.skipped.too_large == 1);
    CHECK(tree.stats.skipped.zero_area == 2);
    CHECK(tree.bounds == Bounds3f{{0, 0, 0}, {1, 1, 0}});
    check_tree(mesh);
}

TEST_CASE("100,000 identical triangles, and as many with one centroid") {
    TriangleMesh same;
    same.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    same.triangles.assign(100000, {0, 1, 2});
    CHECK(check_tree(same).depth <= 20);

    TriangleMesh rings;
    for (std::uint32_t i = 0; i < 100000; ++i) {
        const float r = 1.0f + static_cast<float>(i);
        rings.positions.insert(rings.positions.end(), {{-r, -r, 0}, {r, -r, 0}, {0, r, 0}});
        rings.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    CHECK(check_tree(rings).depth <= kMaxDepth);
}

TEST_CASE("depth stays within the stack where every split would peel off one triangle") {
    TriangleMesh mesh;
    float size = 1e-15f;
    for (std::uint32_t i = 0; i < 3000; ++i, size *= 1.025f) {
        mesh.positions.insert(mesh.positions.end(),
                              {{size, 0, 0}, {size * 1.01f, size, 0}, {size, 0, size}});
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    BuildOptions options;
    options.max_leaf_size = 1;
    CHECK(check_tree(mesh, options).depth > 30);
}

TEST_CASE("leaves are no larger than asked") {
    for (const int size : {1, 2, 5, 64}) {
        BuildOptions options;
        options.max_leaf_size = size;
        options.traversal_cost = 100.0f;
        for (const Node& node : build_tree(tools::make_soup(5000, 3).view(), options).nodes) {
            CHECK(node.count <= static_cast<std::uint32_t>(size));
        }
    }
}

TEST_CASE("the tree is the same, to the byte, for any number of threads and every time") {
    for (const AccelName& accel : accel_names()) {
        CAPTURE(accel.name);
        const TriangleMesh mesh = tools::make_city(120000, 5);
        BuildOptions options;
        options.accel = accel.kind;
        options.threads = 1;
        const auto want = bytes_of(build_tree(mesh.view(), options));
        for (const int threads : {1, 2, 8}) {
            options.threads = threads;
            for (int repeat = 0; repeat < 3; ++repeat) {
                CHECK(bytes_of(build_tree(mesh.view(), options)) == want);
            }
        }
    }
}

TEST_CASE("the surface area heuristic beats halving") {
    const TriangleMesh mesh = tools::make_city(50000, 5);
    const BuildStats stats = build_tree(mesh.view(), {}).stats;
    CHECK(stats.seconds > 0.0);
    CHECK(stats.leaf_count == (stats.node_count + 1) / 2);
    CHECK(stats.sah_cost > 1.0);
    CHECK(stats.sah_cost < 60.0);  // halving along the widest axis comes to over 100 here
}

TEST_CASE("bad options and bad indices are errors that name them") {
    const TriangleMesh mesh = tools::make_soup(10, 1);
    BuildOptions options;
    options.max_leaf_size = 0;
    CHECK_THROWS_WITH_AS((void)build_tree(mesh.view(), options),
                         "BuildOptions::max_leaf_size must be 1 to 64", Error);
    options = {};
    options.traversal_cost = std::nanf("");
    CHECK_THROWS_AS((void)build_tree(mesh.view(), options), Error);
    options = {};
    options.threads = -1;
    CHECK_THROWS_AS((void)build_tree(mesh.view(), options), Error);
    TriangleMesh bad = mesh;
    bad.triangles[4].y = 30;
    CHECK_THROWS_WITH_AS((void)build_tree(bad.view(), {}), "triangle 4 refers to vertex 30 of 30",
                         Error);
}
