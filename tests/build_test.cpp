// Structures: what any of them must hold, whatever the triangles.
#include "configurations.h"
#include "generate.h"
#include "share.h"
#include "test_rays.h"

#include "build/bvh_sah.h"
#include "build/tree.h"
#include "build/validate_tree.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

using namespace packet;
using namespace packet::test;

namespace {

struct Walked {
    std::vector<std::vector<Bounds3f>> boxes;  ///< per triangle, of the leaves that hold it
    int depth = 0;
    std::size_t nodes = 0;
};

Bounds3f box_of(const Node& node) {
    return {{node.plane[0][0], node.plane[0][1], node.plane[0][2]},
            {node.plane[1][0], node.plane[1][1], node.plane[1][2]}};
}

bool is_grid(AccelKind kind) { return kind == AccelKind::kGrid || kind == AccelKind::kGridOfTrees; }

/// A tree's arrays, or those of one cell's.
struct Arrays {
    std::span<const Node> nodes;
    std::span<const TriangleBlock> blocks;

    void note(const Node& leaf, const Bounds3f& box, Walked& out) const {
        for (std::uint32_t i = leaf.link; i < leaf.link + leaf.count; ++i) {
            REQUIRE(i / kBlockSize < blocks.size());
            const auto id = blocks[i / kBlockSize].prim_id[i % kBlockSize];
            out.boxes.at(static_cast<std::size_t>(id)).push_back(box);
        }
    }
};

/// Visits the whole tree; checks that boxes contain their children, and notes the box of the leaf
/// for each triangle in it.
void walk(const Arrays& tree, std::uint32_t id, int depth, Walked& out) {
    REQUIRE(id < tree.nodes.size());
    ++out.nodes;  // links lead on, so there are no cycles
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
    tree.note(node, box, out);
}

/// The box of a grid's cell.
Bounds3f box_of_cell(const Grid& grid, std::size_t brick, std::size_t bit) {
    Bounds3f box;
    for (int a = 0; a < 3; ++a) {
        const auto sides = static_cast<std::size_t>(grid.brick_count[a]);
        const std::size_t place = brick % sides * kBrickSide + (bit >> 2 * a & 3);
        box.lower[a] = grid.planes[a].at(place);
        box.upper[a] = grid.planes[a].at(place + 1);
        brick /= sides;
    }
    return box;
}

/// The arrays of a cell's tree, which end where the next begin.
Arrays arrays_of(const Tree& tree, std::size_t id) {
    const auto& trees = tree.grid.trees;
    const std::size_t nodes = id + 1 < trees.size() ? trees[id + 1].node : tree.nodes.size();
    const std::size_t blocks = id + 1 < trees.size() ? trees[id + 1].block : tree.blocks.size();
    const GridTree& begin = trees.at(id);
    return {std::span(tree.nodes).subspan(begin.node, nodes - begin.node),
            std::span(tree.blocks).subspan(begin.block, blocks - begin.block)};
}

/// Visits all cells; notes the box of the cell for each triangle in it.
void walk_grid(const Tree& tree, Walked& out) {
    const Grid& grid = tree.grid;
    std::size_t cells = 0, leaves = 0;
    for (std::size_t b = 0; b < grid.bricks.size(); ++b) {
        if (grid.bricks[b].occupied != 0) CHECK(grid.bricks[b].first_cell == cells);
        for (std::size_t bit = 0; bit < 64; ++bit) {
            if ((grid.bricks[b].occupied >> bit & 1) == 0) continue;
            const GridCell& cell = grid.cells.at(cells++);
            const Bounds3f box = box_of_cell(grid, b, bit);
            if (cell.count != 0) {
                Arrays{{}, tree.blocks}.note({{}, cell.first, cell.count}, box, out);
                ++leaves;
            } else {
                walk(arrays_of(tree, cell.first), 0, 0, out);
                CHECK(box.contains(box_of(tree.nodes[grid.trees[cell.first].node])));
            }
        }
    }
    CHECK(cells == grid.cells.size());
    for (const Node& node : tree.nodes) leaves += node.is_leaf();
    CHECK(leaves == tree.stats.leaf_count);
}

/// Points of a triangle with weights in steps of 1/6, corners, edges and inside.
std::vector<glm::dvec3> sample(const TriangleMesh& mesh, const glm::uvec3& triangle) {
    std::vector<glm::dvec3> points;
    for (int i = 0; i <= 6; ++i) {
        for (int j = 0; i + j <= 6; ++j) {
            points.push_back((glm::dvec3(mesh.positions[triangle.x]) * double(i) +
                              glm::dvec3(mesh.positions[triangle.y]) * double(j) +
                              glm::dvec3(mesh.positions[triangle.z]) * double(6 - i - j)) /
                             6.0);
        }
    }
    return points;
}

/// In the box, or as near to it as the point is to what it was meant to be.
bool contains(const Bounds3f& box, const glm::dvec3& p) {
    const double error = 1e-14 * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) + 1e-300;
    const glm::dvec3 lower(box.lower), upper(box.upper);
    for (int a = 0; a < 3; ++a) {
        if (p[a] < lower[a] - error || p[a] > upper[a] + error) return false;
    }
    return true;
}

/// Every point of the triangle is in some leaf that holds it; where triangles are not cut, there
/// is one such leaf.
void check_coverage(const TriangleMesh& mesh, const Walked& walked, AccelKind kind) {
    std::size_t uncovered = 0, repeated = 0;
    for (std::size_t id = 0; id < mesh.triangles.size(); ++id) {
        const auto& boxes = walked.boxes[id];
        if (boxes.empty()) continue;
        repeated += boxes.size() > 1;
        for (const glm::dvec3& p : sample(mesh, mesh.triangles[id])) {
            uncovered += std::none_of(boxes.begin(), boxes.end(),
                                      [&](const Bounds3f& box) { return contains(box, p); });
        }
    }
    CHECK(uncovered == 0);
    if (!cuts_triangles(kind)) CHECK(repeated == 0);
}

Walked check_tree(const TriangleMesh& mesh, const BuildOptions& options = {}) {
    const Tree tree = build_tree(mesh.view(), options);
    Walked out;
    out.boxes.resize(mesh.triangles.size());
    if (!tree.grid.empty()) {
        walk_grid(tree, out);
    } else if (!tree.nodes.empty()) {
        walk({tree.nodes, tree.blocks}, 0, 0, out);
    }
    CHECK(out.nodes == tree.nodes.size());
    if (tree.grid.empty()) CHECK(out.nodes == tree.stats.node_count);
    CHECK(out.depth == tree.stats.depth);
    CHECK(out.depth <= kMaxDepth);
    std::size_t reachable = 0, references = 0;
    for (const auto& boxes : out.boxes) {
        reachable += !boxes.empty();
        references += boxes.size();
    }
    CHECK(reachable + tree.stats.skipped.total() == mesh.triangles.size());
    CHECK(static_cast<float>(references) <=
          options.max_reference_factor * static_cast<float>(reachable));
    check_coverage(mesh, out, options.accel);
    return out;
}

/// fn(options) for every structure.
template <class Fn>
void for_each_accel(Fn fn) {
    for (const Build& build : all_builds()) {
        CAPTURE(build.name);
        fn(build.options);
    }
}

std::vector<unsigned char> bytes_of(const Tree& tree) {
    std::vector<unsigned char> out;
    const auto append = [&](const auto& items) {
        const std::size_t begin = out.size(), bytes = items.size() * sizeof(items[0]);
        out.resize(begin + bytes);
        if (bytes != 0) std::memcpy(out.data() + begin, items.data(), bytes);
    };
    append(tree.nodes);
    append(tree.wide_nodes);
    append(tree.blocks);
    append(tree.treelets.begin);
    append(tree.treelets.of_node);
    append(tree.grid.bricks);
    append(tree.grid.cells);
    append(tree.grid.trees);
    for (const auto& planes : tree.grid.planes) append(planes);
    return out;
}

}  // namespace

TEST_CASE("a tree holds every triangle, whole or in parts, in boxes that contain it") {
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        for (const std::size_t all : {1u, 2u, 3u, 10u, 1000u, 10000u}) {
            const std::size_t count = share_of(all, 500);
            CAPTURE(kind.name);
            CAPTURE(count);
            for_each_accel(
                [&](const BuildOptions& options) { check_tree(kind.make(count, 1), options); });
        }
    }
}

TEST_CASE("a mesh without triangles, or none that can be hit, is empty and hits nothing") {
    TriangleMesh empty;
    TriangleMesh degenerate;
    degenerate.positions = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
    degenerate.triangles = {{0, 1, 2}, {0, 0, 1}, {1, 1, 1}};
    for (const TriangleMesh& mesh : {empty, degenerate}) {
        for_each_accel([&](const BuildOptions& options) { check_tree(mesh, options); });
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
    for_each_accel([&](const BuildOptions& options) { check_tree(mesh, options); });
}

TEST_CASE("100,000 identical triangles, and as many with one centroid") {
    TriangleMesh same;
    same.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    same.triangles.assign(share_of(100000, 5000), {0, 1, 2});
    for_each_accel(
        [&](const BuildOptions& options) { CHECK(check_tree(same, options).depth <= 20); });

    TriangleMesh rings;
    for (std::uint32_t i = 0; i < share_of(100000, 5000); ++i) {
        const float r = 1.0f + static_cast<float>(i);
        rings.positions.insert(rings.positions.end(), {{-r, -r, 0}, {r, -r, 0}, {0, r, 0}});
        rings.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    for_each_accel([&](const BuildOptions& options) { check_tree(rings, options); });
}

TEST_CASE("depth stays within the stack where every split would peel off one triangle") {
    TriangleMesh mesh;
    float size = 1e-15f;
    for (std::uint32_t i = 0; i < 3000; ++i, size *= 1.025f) {
        mesh.positions.insert(mesh.positions.end(),
                              {{size, 0, 0}, {size * 1.01f, size, 0}, {size, 0, size}});
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    for_each_accel([&](BuildOptions options) {
        options.max_leaf_size = 1;
        const int depth = check_tree(mesh, options).depth;
        if (!is_grid(options.accel)) CHECK(depth > 10);
    });
}

TEST_CASE("leaves are no larger than asked") {
    const TriangleMesh mesh = tools::make_soup(5000, 3);
    for (const int size : {1, 2, 5, 64}) {
        for_each_accel([&](BuildOptions options) {
            options.max_leaf_size = size;
            options.traversal_cost = 100.0f;
            for (const Node& node : build_tree(mesh.view(), options).nodes) {
                CHECK(node.count <= static_cast<std::uint32_t>(size));
            }
        });
    }
}

TEST_CASE("the tree is the same, to the byte, for any number of threads and every time") {
    const TriangleMesh mesh = tools::make_city(70000, 5);  // every loop is cut into pieces
    for_each_accel([&](BuildOptions options) {
        options.threads = 1;
        const auto want = bytes_of(build_tree(mesh.view(), options));
        for (const int threads : {1, 2, 8}) {
            options.threads = threads;
            for (std::size_t repeat = 0; repeat < share_of(10); ++repeat) {
                CHECK(bytes_of(build_tree(mesh.view(), options)) == want);
            }
        }
    });
}

TEST_CASE("the surface area heuristic beats halving") {
    const TriangleMesh mesh = tools::make_city(50000, 5);
    const BuildStats stats = build_tree(mesh.view(), {}).stats;
    CHECK(stats.seconds > 0.0);
    CHECK(stats.leaf_count == (stats.node_count + 1) / 2);
    CHECK(stats.sah_cost > 1.0);
    CHECK(stats.sah_cost < 60.0);  // halving along the widest axis comes to over 100 here
}

namespace {

/// Checks that a hierarchy holds each of the references once, in boxes that contain theirs.
void check_hierarchy(const Hierarchy& hierarchy, const ScratchVector<Reference>& references) {
    std::vector<int> times(references.size());
    std::vector<std::pair<std::uint32_t, int>> stack = {{0, 0}};
    while (!stack.empty()) {
        const auto [id, depth] = stack.back();
        stack.pop_back();
        const BuildNode& node = hierarchy.nodes.at(id);
        CHECK(depth <= kMaxDepth);
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
            const std::uint32_t reference = hierarchy.ids.at(i);
            ++times.at(reference);
            CHECK(node.bounds.contains(references[reference].bounds()));
        }
        if (node.is_leaf()) continue;
        for (const std::uint32_t child : {node.first, node.second}) {
            CHECK(node.bounds.contains(hierarchy.nodes.at(child).bounds));
            stack.emplace_back(child, depth + 1);
        }
    }
    CHECK(std::ranges::count(times, 1) == static_cast<std::ptrdiff_t>(times.size()));
}

ScratchVector<Reference> point_references(std::size_t count, const auto& point) {
    ScratchVector<Reference> out(count);
    for (std::size_t i = 0; i < count; ++i) {
        const glm::vec3 at = point(i);
        out[i] = {at, static_cast<std::uint32_t>(i), at};
    }
    return out;
}

}  // namespace

TEST_CASE("trees by cells cost little more than others, and are the same for all threads") {
    // Enough to be cut into pieces. Triangles of the soup fill space, the others' form surfaces.
    for (const auto& make : {tools::make_soup, tools::make_terrain, tools::make_stadium}) {
        const TriangleMesh mesh = make(70000, 3);
        const BuildOptions options;
        const Parallel one(1), two(2);
        const References references = collect_references(mesh.view(), one);
        const Hierarchy by_cells = build_bvh_sah_by_cells(references.items, options, one);
        check_hierarchy(by_cells, references.items);
        const auto cost = [&](const Hierarchy& hierarchy) {
            return make_tree(hierarchy, mesh.view(), options, one).stats.sah_cost;
        };
        CHECK(cost(by_cells) < 1.15 * cost(build_bvh_sah(references.items, options, one)));
        const Tree tree = make_tree(by_cells, mesh.view(), options, one);
        const Hierarchy again = build_bvh_sah_by_cells(references.items, options, two);
        CHECK(bytes_of(make_tree(again, mesh.view(), options, two)) == bytes_of(tree));
    }
}

TEST_CASE("trees by cells hold whatever boxes there are") {
    const auto same = [](std::size_t) { return glm::vec3(1.0f, 2.0f, 3.0f); };
    const auto line = [](std::size_t i) { return glm::vec3(0.0f, static_cast<float>(i), 5.0f); };
    const auto growing = [](std::size_t i) {
        return glm::vec3(std::pow(1.02f, static_cast<float>(i)), 0.0f, 0.0f);
    };
    const auto tiny = [](std::size_t i) { return glm::vec3(1e-45f * static_cast<float>(i % 3)); };
    const auto huge = [](std::size_t i) { return glm::vec3(i % 2 == 0 ? 3e38f : -3e38f); };
    const BuildOptions options;
    const Parallel parallel(1);
    const auto check = [&](const auto& point) {
        for (const std::size_t count : {2047u, 2048u, 4000u}) {
            const ScratchVector<Reference> references = point_references(count, point);
            check_hierarchy(build_bvh_sah_by_cells(references, options, parallel), references);
        }
    };
    check(same);
    check(line);
    check(growing);
    check(tiny);
    check(huge);
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
