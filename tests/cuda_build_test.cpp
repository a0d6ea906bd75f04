// Building on the device: the hierarchy is the CPU's, node for node (of bvh-morton in another
// order).
#include "build/bvh_morton.h"
#include "build/kd_levels.h"
#include "build/tree.h"
#include "cuda_device.h"
#include "downloaded_build.h"
#include "generate.h"
#include "test_rays.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <string>

using namespace packet;
using namespace packet::test;

TEST_SUITE_BEGIN("cuda_build");

namespace {

/// From the root: both may keep their nodes in any order.
bool is_same(const Hierarchy& a, std::uint32_t node_a, const Hierarchy& b, std::uint32_t node_b) {
    const BuildNode &x = a.nodes[node_a], &y = b.nodes[node_b];
    if (x.bounds != y.bounds || x.count != y.count) return false;
    if (x.is_leaf()) return x.first == y.first;
    return is_same(a, x.first, b, y.first) && is_same(a, x.second, b, y.second);
}

void check_same_tree(const Hierarchy& got, const Hierarchy& want) {
    CHECK(got.ids == want.ids);
    REQUIRE(got.nodes.empty() == want.nodes.empty());
    CHECK((want.nodes.empty() || is_same(got, 0, want, 0)));
}

/// Each node in the same place.
void check_same_nodes(const Hierarchy& got, const Hierarchy& want) {
    CHECK(got.ids == want.ids);
    REQUIRE(got.nodes.size() == want.nodes.size());
    CHECK((want.nodes.empty() || std::memcmp(got.nodes.data(), want.nodes.data(),
                                             want.nodes.size() * sizeof(BuildNode)) == 0));
}

/// Calls fn() for each order in which threads may run.
template <class Fn>
void for_thread_orders(Fn&& fn) {
    for (int order = 0; order < kThreadOrders; ++order) {
        set_thread_order(order);
        CAPTURE(order);
        fn();
    }
    set_thread_order(0);
}

void check_same(const ScratchVector<Reference>& references, const BuildOptions& options) {
    const Hierarchy want = build_bvh_morton(references, options, Parallel(1));
    for_thread_orders(
        [&] { check_same_tree(cuda::download_bvh_morton(references, options), want); });
}

void check_same_kd_tree(const TriangleMesh& mesh, BuildOptions options) {
    options.accel = AccelKind::kKdSah;
    const References references = collect_references(mesh.view(), Parallel(1));
    const Hierarchy want = build_kd_levels(mesh.view(), references.items, options, Parallel(1));
    for_thread_orders(
        [&] { check_same_nodes(cuda::download_hierarchy(mesh.view(), options), want); });
}

/// A tree that is laid out on the device is the CPU's: each node, and what is in each leaf.
void check_layout(const cuda::DownloadedTree& got, const Tree& want) {
    REQUIRE(got.nodes.size() == want.nodes.size());
    CHECK(got.depth == want.stats.depth);
    CHECK(got.bounds == want.bounds);
    for (std::size_t i = 0; i < got.nodes.size(); ++i) {
        const Node &a = got.nodes[i], &b = want.nodes[i];
        REQUIRE(std::memcmp(a.plane, b.plane, sizeof(a.plane)) == 0);
        REQUIRE(a.count == b.count);
        if (!a.is_leaf()) REQUIRE(a.link == b.link);
        for (std::uint32_t k = 0; k < a.count; ++k) {
            const std::array<float, 12>& triangle = got.triangles[a.link + k];
            const TriangleBlock& block = want.blocks[(b.link + k) / kBlockSize];
            const std::uint32_t lane = (b.link + k) % kBlockSize;
            REQUIRE(std::memcmp(&triangle[3], &block.prim_id[lane], 4) == 0);
            for (std::size_t corner = 0; corner < 3; ++corner) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    REQUIRE(triangle[4 * corner + axis] == block.v[corner][axis][lane]);
                }
            }
        }
    }
}

Reference point_reference(const glm::vec3& point, std::size_t id) {
    return {point, static_cast<std::uint32_t>(id), point};
}

}  // namespace

TEST_CASE("every generated scene, with codes of either width") {
    if (!has_device()) return;
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        const TriangleMesh mesh = kind.make(3000, 3);
        const References references = collect_references(mesh.view(), Parallel(1));
        for (const int bits : {30, 63}) {
            INFO(std::string(kind.name) << " " << bits);
            BuildOptions options;
            options.morton_bits = bits;
            check_same(references.items, options);
            options.max_leaf_size = 1;
            check_same(references.items, options);
        }
    }
}

TEST_CASE("few references, and many at one place") {
    if (!has_device()) return;
    for (const std::size_t count : {0u, 1u, 2u, 3u, 1000u}) {
        CAPTURE(count);
        ScratchVector<Reference> references;
        for (std::size_t i = 0; i < count; ++i) {
            references.push_back(point_reference({1, 2, 3}, i));
        }
        check_same(references, {});
    }
}

TEST_CASE("codes that would lead too deep") {
    if (!has_device()) return;
    // Points whose codes are powers of 2, and thousands more at the origin.
    ScratchVector<Reference> references;
    for (std::size_t i = 0; i < 3000; ++i) references.push_back(point_reference({0, 0, 0}, i));
    for (int bit = 0; bit < 21; ++bit) {
        for (int axis = 0; axis < 3; ++axis) {
            glm::vec3 point(0.0f);
            point[axis] = static_cast<float>(1 << bit);
            references.push_back(point_reference(point, references.size()));
        }
    }
    references.push_back(point_reference(glm::vec3(1 << 21), references.size()));
    BuildOptions options;
    options.morton_bits = 63;
    options.max_leaf_size = 1;
    check_same(references, options);
}

TEST_CASE("a k-d tree of every generated scene") {
    if (!has_device()) return;
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        for (const std::size_t count : {30u, 1000u, 4000u}) {
            INFO(std::string(kind.name) << " " << count);
            check_same_kd_tree(kind.make(count, 3), {});
        }
    }
}

TEST_CASE("a k-d tree where cuts are scarce, leaves small, or costs odd") {
    if (!has_device()) return;
    const TriangleMesh mesh = tools::make_hairball(1500, 5);
    BuildOptions options;
    options.max_reference_factor = 1.0f;  // halved, not cut
    check_same_kd_tree(mesh, options);
    options.max_reference_factor = 1.3f;
    options.max_leaf_size = 1;
    check_same_kd_tree(mesh, options);
    options.max_reference_factor = 64.0f;
    options.traversal_cost = 0.0f;  // cut to the greatest depth
    check_same_kd_tree(mesh, options);
    options.traversal_cost = 1e4f;  // no cut pays
    check_same_kd_tree(mesh, options);
}

TEST_CASE("a k-d tree of a few triangles, of none, of many at one place, and of a lattice") {
    if (!has_device()) return;
    check_same_kd_tree({}, {});
    const TriangleMesh one{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}};
    check_same_kd_tree(one, {});
    TriangleMesh many = one;
    many.triangles.assign(700, {0, 1, 2});  // no plane parts them
    check_same_kd_tree(many, {});
    many.triangles.insert(many.triangles.begin() + 5, {0, 0, 1});  // can never be hit
    check_same_kd_tree(many, {});
    // Boxes that begin, end and are flat in the same planes, some at -0.
    TriangleMesh lattice = make_grid(20, 20, {-1, -1, -0.0f}, {0.1f, 0, 0}, {0, 0.1f, 0});
    for (glm::vec3& p : lattice.positions) {
        for (int a = 0; a < 3; ++a) p[a] = std::round(p[a] * 10) * (p[a] < 0 ? 1.0f : 0.5f);
    }
    check_same_kd_tree(lattice, {});
}

TEST_CASE("the layout of a tree is the CPU's") {
    if (!has_device()) return;
    const TriangleMesh mesh = tools::make_city(2000, 3);
    for (const AccelKind kind : {AccelKind::kBvhMorton, AccelKind::kKdSah}) {
        BuildOptions options;
        options.accel = kind;
        options.keep_binary_nodes = true;
        const Tree want = build_tree(mesh.view(), options);
        for_thread_orders([&] { check_layout(cuda::download_tree(mesh.view(), options), want); });
    }
}
