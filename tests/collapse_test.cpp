// The 8-wide form: leaves that straddle no blocks, and nodes that are well filled. That it holds
// what the binary form does is validate()'s matter.
#include "generate.h"

#include "build/validate_tree.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>

using namespace packet;

namespace {

/// fn(first, count) for every child that is there.
template <class Fn>
void for_each_child(const Tree& tree, Fn fn) {
    for (const WideNode& node : tree.wide_nodes) {
        for (int i = 0; i < kWideSize; ++i) {
            if (node.plane[0][0][i] <= node.plane[1][0][i])
                fn(node.child[i].link, node.child[i].count);
        }
    }
}

}  // namespace

TEST_CASE("wide leaves that fit into a block do not straddle two") {
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        for (const std::size_t count : {1u, 2u, 9u, 1000u, 30000u}) {
            CAPTURE(kind.name);
            CAPTURE(count);
            const TriangleMesh mesh = kind.make(count, 1);
            const Tree tree = build_tree(mesh.view(), {});
            validate(tree, mesh.view(), AccelKind::kBvh);
            for_each_child(tree, [](std::uint32_t first, std::uint32_t items) {
                if (items == 0 || items > kBlockSize) return;
                CHECK(first / kBlockSize == (first + items - 1) / kBlockSize);
            });
        }
    }
}

TEST_CASE("the spacing of leaves follows from their boxes") {
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        for (const std::size_t count : {1u, 300u, 30000u}) {
            CAPTURE(kind.name);
            CAPTURE(count);
            const TriangleMesh mesh = kind.make(count, 1);
            const Tree tree = build_tree(mesh.view(), {});
            double area = 0.0, side = 0.0;
            for (const WideNode& node : tree.wide_nodes) {
                for (int i = 0; i < kWideSize; ++i) {
                    if (!(node.plane[0][0][i] <= node.plane[1][0][i])) continue;
                    if (!node.child[i].is_leaf()) continue;
                    Bounds3f box;
                    for (int a = 0; a < 3; ++a) {
                        box.lower[a] = node.plane[0][a][i];
                        box.upper[a] = node.plane[1][a][i];
                    }
                    area += static_cast<double>(box.half_area());
                    side += std::sqrt(static_cast<double>(box.half_area()));
                }
            }
            const double of_all = static_cast<double>(tree.bounds.half_area());
            CHECK(tree.leaf_spacing == doctest::Approx(std::sqrt(area * of_all) / side));
        }
    }
}

TEST_CASE("leaves of finer meshes are closer together, also by threads") {
    BuildOptions options;
    float last = std::numeric_limits<float>::infinity();
    for (const std::size_t count : {300u, 3000u, 30000u}) {
        const TriangleMesh mesh = tools::make_terrain(count, 1);
        options.threads = 1;
        const float spacing = build_tree(mesh.view(), options).leaf_spacing;
        CHECK(spacing < last / 2);
        options.threads = 8;
        CHECK(build_tree(mesh.view(), options).leaf_spacing == spacing);
        last = spacing;
    }
}

TEST_CASE("binary nodes are kept only if asked for, and change nothing else") {
    for (const AccelKind kind : {AccelKind::kBvh, AccelKind::kBvhMorton, AccelKind::kOctree,
                                 AccelKind::kKdSah, AccelKind::kGridOfTrees}) {
        CAPTURE(to_string(kind));
        const TriangleMesh mesh = tools::make_city(20000, 1);
        BuildOptions options;
        options.accel = kind;
        options.keep_binary_nodes = true;
        const Tree with = build_tree(mesh.view(), options);
        options.keep_binary_nodes = false;
        const Tree without = build_tree(mesh.view(), options);
        validate(without, mesh.view(), kind);
        CHECK(!with.nodes.empty());
        CHECK(without.nodes.empty());
        CHECK(without.stats.node_count == with.stats.node_count);
        CHECK(without.stats.bytes + with.nodes.size() * sizeof(Node) == with.stats.bytes);
        REQUIRE(without.wide_nodes.size() == with.wide_nodes.size());
        REQUIRE(without.blocks.size() == with.blocks.size());
        CHECK(std::memcmp(without.wide_nodes.data(), with.wide_nodes.data(),
                          with.wide_nodes.size() * sizeof(WideNode)) == 0);
        CHECK(std::memcmp(without.blocks.data(), with.blocks.data(),
                          with.blocks.size() * sizeof(TriangleBlock)) == 0);
    }
}

TEST_CASE("wide nodes are well filled and their leaves share blocks") {
    const Tree tree = build_tree(tools::make_city(50000, 1).view(), {});
    std::size_t children = 0;
    for_each_child(tree, [&](std::uint32_t, std::uint32_t) { ++children; });
    CHECK(children > 4 * tree.wide_nodes.size());
    CHECK(tree.blocks.size() * kBlockSize < 1.05 * 50000);
}
