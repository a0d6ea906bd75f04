// The octree: where it cuts, and that its 8-wide form is its own.
#include "generate.h"

#include "build/tree.h"

#include <packet/error.h>

#include <doctest/doctest.h>

using namespace packet;

namespace {

BuildOptions octree_options(int max_leaf_size = 8) {
    BuildOptions options;
    options.keep_binary_nodes = true;
    options.accel = AccelKind::kOctree;
    options.max_leaf_size = max_leaf_size;
    return options;
}

void add_triangle(TriangleMesh& mesh, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c});
    mesh.triangles.push_back({first, first + 1, first + 2});
}

/// A small triangle at each corner of the unit cube's copy at `origin`; none reaches its middle.
void add_corners(TriangleMesh& mesh, const glm::vec3& origin, float size) {
    for (unsigned i = 0; i < 8; ++i) {
        const glm::vec3 towards(i & 1 ? -1 : 1, i & 2 ? -1 : 1, i & 4 ? -1 : 1);
        const glm::vec3 corner = origin + size * glm::vec3(i & 1, i >> 1 & 1, i >> 2 & 1);
        const glm::vec3 step = 0.125f * size * towards;
        add_triangle(mesh, corner, corner + glm::vec3(step.x, 0, 0),
                     corner + glm::vec3(0, step.y, step.z));
    }
}

int child_count(const WideNode& node) {
    int count = 0;
    for (int i = 0; i < kWideSize; ++i) count += node.plane[0][0][i] <= node.plane[1][0][i];
    return count;
}

}  // namespace

TEST_CASE("a cell is one wide node, with a child for each octant that holds something") {
    TriangleMesh mesh;
    add_corners(mesh, {0, 0, 0}, 1.0f);
    const Tree one = build_tree(mesh.view(), octree_options(1));
    REQUIRE(one.wide_nodes.size() == 1);
    CHECK(one.nodes.size() == 15);  // three levels of halves
    CHECK(one.stats.depth == 3);
    for (int i = 0; i < kWideSize; ++i) {
        CHECK(one.wide_nodes[0].child[i].count == 1);
        CHECK(one.wide_nodes[0].plane[0][0][i] == ((i & 1) != 0 ? 0.875f : 0.0f));
        CHECK(one.wide_nodes[0].plane[1][1][i] == ((i & 2) != 0 ? 1.0f : 0.125f));
        CHECK(one.wide_nodes[0].plane[1][2][i] == ((i & 4) != 0 ? 1.0f : 0.125f));
    }
    // In one corner eight again: of the cells in between, which have one child, there is no node.
    add_corners(mesh, {0, 0, 0}, 1.0f / 64);
    const Tree two = build_tree(mesh.view(), octree_options(1));
    CHECK(two.wide_nodes.size() >= 2);
    CHECK(child_count(two.wide_nodes[0]) == 8);
    CHECK(two.wide_nodes[0].child[0].count == 0);
    for (int i = 1; i < kWideSize; ++i) CHECK(two.wide_nodes[0].child[i].count == 1);
}

TEST_CASE("a triangle across all octants that passes some of them by is in the others") {
    TriangleMesh mesh;
    add_corners(mesh, {0, 0, 0}, 1.0f);
    add_triangle(mesh, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});  // x + y + z = 1: not at (1, 1, 1)
    const Tree tree = build_tree(mesh.view(), octree_options(2));
    REQUIRE(tree.wide_nodes.size() == 1);
    const WideNode& node = tree.wide_nodes[0];
    CHECK(node.child[0].count == 2);
    for (const int i : {1, 2, 4}) CHECK(node.child[i].count == 2);
    for (const int i : {3, 5, 6}) CHECK(node.child[i].count == 2);  // meets their corner, or edge
    CHECK(node.child[7].count == 1);
}

TEST_CASE("fewer levels make larger cells, and none cuts nothing") {
    const TriangleMesh mesh = tools::make_hairball(3000, 2);
    const auto item_count = [&](int levels) {
        BuildOptions options = octree_options();
        options.octree_levels = levels;
        std::size_t count = 0;
        for (const Node& node : build_tree(mesh.view(), options).nodes) count += node.count;
        return count;
    };
    CHECK(item_count(0) == mesh.triangles.size());
    CHECK(item_count(0) < item_count(1));
    CHECK(item_count(1) < item_count(3));
    CHECK(item_count(3) < item_count(21));
    for (const int bad : {-1, 22}) {
        BuildOptions options = octree_options();
        options.octree_levels = bad;
        CHECK_THROWS_WITH_AS((void)build_tree(mesh.view(), options),
                             "BuildOptions::octree_levels must be 0 to 21", Error);
    }
}
