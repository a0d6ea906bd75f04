// Building on the device: the hierarchy is the CPU's, node for node.
#include "build/bvh_morton.h"
#include "cuda_device.h"
#include "generate.h"
#include "morton_build.h"

#include <doctest/doctest.h>

#include <string>

using namespace packet;
using namespace packet::test;

TEST_SUITE_BEGIN("cuda_build");

namespace {

/// Both may keep their nodes in any order.
bool is_same(const Hierarchy& a, std::uint32_t node_a, const Hierarchy& b, std::uint32_t node_b) {
    const BuildNode &x = a.nodes[node_a], &y = b.nodes[node_b];
    if (x.bounds != y.bounds || x.count != y.count) return false;
    if (x.is_leaf()) return x.first == y.first;
    return is_same(a, x.first, b, y.first) && is_same(a, x.second, b, y.second);
}

void check_same(const ScratchVector<Reference>& references, const BuildOptions& options) {
    const Hierarchy want = build_bvh_morton(references, options, Parallel(1));
    for (int order = 0; order < kThreadOrders; ++order) {
        set_thread_order(order);
        CAPTURE(order);
        const Hierarchy got = cuda::build_bvh_morton(references, options);
        CHECK(got.ids == want.ids);
        REQUIRE(got.nodes.empty() == want.nodes.empty());
        CHECK((want.nodes.empty() || is_same(got, 0, want, 0)));
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
