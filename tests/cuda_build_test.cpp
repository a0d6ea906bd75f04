// Building on the device: the hierarchy is the CPU's, node for node.
#include "build/bvh_morton.h"
#include "build/kd_levels.h"
#include "build/tree.h"
#include "cuda_device.h"
#include "device_references.h"
#include "generate.h"
#include "kd_build.h"
#include "lay_out.h"
#include "morton_build.h"
#include "test_rays.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <string>

using namespace packet;
using namespace packet::test;

TEST_SUITE_BEGIN("cuda_build");

namespace {

void check_equal(const Hierarchy& got, const Hierarchy& want) {
    REQUIRE(got.nodes.size() == want.nodes.size());
    REQUIRE(got.references.size() == want.references.size());
    CHECK((want.nodes.empty() || std::memcmp(got.nodes.data(), want.nodes.data(),
                                             want.nodes.size() * sizeof(BuildNode)) == 0));
    CHECK(
        (want.references.empty() || std::memcmp(got.references.data(), want.references.data(),
                                                want.references.size() * sizeof(Reference)) == 0));
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

cuda::DeviceArray<Reference> upload(const AlignedVector<Reference>& references) {
    return cuda::DeviceArray<Reference>(std::span<const Reference>(references));
}

void check_same(const AlignedVector<Reference>& references, const BuildOptions& options) {
    const Hierarchy want = build_bvh_morton(references, options, Parallel(1));
    for_thread_orders([&] {
        const auto count = static_cast<std::uint32_t>(references.size());
        check_equal(cuda::build_bvh_morton(upload(references), count, options).download(), want);
    });
}

void check_same_kd_tree(const TriangleMesh& mesh, const BuildOptions& options) {
    const References references = collect_references(mesh.view(), Parallel(1));
    const Hierarchy want = build_kd_levels(mesh.view(), references.items, options, Parallel(1));
    for_thread_orders([&] {
        const cuda::UploadedMesh uploaded(mesh.view());
        cuda::DeviceReferences found = cuda::collect_references(uploaded);
        REQUIRE(found.count == references.items.size());
        check_equal(cuda::build_kd_levels(uploaded, std::move(found.items), found.count, options)
                        .download(),
                    want);
    });
}

/// A tree that is laid out on the device is the CPU's: each node, and what is in each leaf.
void check_layout(const cuda::DeviceBuiltTree& got, const Tree& want) {
    REQUIRE(got.node_count == want.nodes.size());
    CHECK(got.depth == want.stats.depth);
    CHECK(got.bounds == want.bounds);
    const cuda::Stream stream;
    std::vector<Node> nodes(got.node_count);
    got.arrays.nodes.copy_to(nodes, stream.get());
    std::vector<cuda::DeviceTriangle> triangles(got.arrays.triangles.size());
    got.arrays.triangles.copy_to(triangles, stream.get());
    stream.synchronize();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const Node &a = nodes[i], &b = want.nodes[i];
        REQUIRE(std::memcmp(a.plane, b.plane, sizeof(a.plane)) == 0);
        REQUIRE(a.count == b.count);
        if (!a.is_leaf()) REQUIRE(a.link == b.link);
        for (std::uint32_t k = 0; k < a.count; ++k) {
            const cuda::DeviceTriangle& triangle = triangles[a.link + k];
            const TriangleBlock& block = want.blocks[(b.link + k) / kBlockSize];
            const std::uint32_t lane = (b.link + k) % kBlockSize;
            REQUIRE(std::memcmp(&triangle.corner[0].w, &block.prim_id[lane], 4) == 0);
            for (int c = 0; c < 3; ++c) {
                REQUIRE(triangle.corner[c].x == block.v[c][0][lane]);
                REQUIRE(triangle.corner[c].y == block.v[c][1][lane]);
                REQUIRE(triangle.corner[c].z == block.v[c][2][lane]);
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
        AlignedVector<Reference> references;
        for (std::size_t i = 0; i < count; ++i) {
            references.push_back(point_reference({1, 2, 3}, i));
        }
        check_same(references, {});
    }
}

TEST_CASE("codes that would lead too deep") {
    if (!has_device()) return;
    // Points whose codes are powers of 2, and thousands more at the origin.
    AlignedVector<Reference> references;
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
    const cuda::UploadedMesh uploaded(mesh.view());
    for (const AccelKind kind : {AccelKind::kBvhMorton, AccelKind::kKdSah}) {
        BuildOptions options;
        options.accel = kind;
        const Tree want = build_tree(mesh.view(), options);
        for_thread_orders([&] {
            cuda::DeviceReferences found = cuda::collect_references(uploaded);
            const cuda::DeviceHierarchy hierarchy =
                kind == AccelKind::kKdSah
                    ? cuda::build_kd_levels(uploaded, std::move(found.items), found.count, options)
                    : cuda::build_bvh_morton(std::move(found.items), found.count, options);
            check_layout(cuda::lay_out(hierarchy, uploaded), want);
        });
    }
}
