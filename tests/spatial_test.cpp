// Hierarchies with spatial splits: what they may add, what that is worth, and where it goes wrong.
#include "generate.h"
#include "test_rays.h"

#include "build/object_split.h"
#include "build/spatial_split.h"
#include "build/tree.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace packet;
using namespace packet::test;

namespace {

constexpr std::size_t kAll = 1'000'000;  // samples, at least

void add_triangle(TriangleMesh& mesh, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c});
    mesh.triangles.push_back({first, first + 1, first + 2});
}

/// Long and thin, each from one face of the unit cube to another: their boxes are nearly all of it.
TriangleMesh make_diagonals(int count, std::uint64_t seed) {
    TriangleMesh mesh;
    tools::Random random(seed);
    for (int i = 0; i < count; ++i) {
        const glm::vec3 p = random.point(), q = glm::vec3(1.0f) - 0.3f * random.point();
        add_triangle(mesh, 0.3f * p, q, q + 0.01f * random.direction());
    }
    return mesh;
}

BuildOptions spatial_options(float budget) {
    BuildOptions options;
    options.accel = AccelKind::kBvhSpatial;
    options.spatial_budget = budget;
    options.keep_binary_nodes = true;
    return options;
}

std::size_t reference_count(const Tree& tree) {
    std::size_t count = 0;
    for (const Node& node : tree.nodes) count += node.count;
    return count;
}

bool are_same(const Tree& a, const Tree& b) {
    const auto same = [](const auto& x, const auto& y) {
        if (x.size() != y.size()) return false;
        return x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0;
    };
    return same(a.nodes, b.nodes) && same(a.wide_nodes, b.wide_nodes) && same(a.blocks, b.blocks);
}

NodeRange whole_node(ScratchVector<Reference>& references, std::size_t room,
                     const Parallel& parallel) {
    NodeRange node;
    const std::size_t count = references.size();
    node.bounds = measure(references, parallel);
    node.room = room;
    references.resize(count + room);
    node.refs = std::span(references).first(count);
    return node;
}

}  // namespace

TEST_CASE("references stay within the budget, use it, and are worth it") {
    const TriangleMesh mesh = make_diagonals(2000, 1);
    std::size_t last = 0;
    double last_cost = INFINITY;
    for (const float budget : {0.0f, 0.1f, 0.5f, 2.0f, 8.0f}) {
        CAPTURE(budget);
        const Tree tree = build_tree(mesh.view(), spatial_options(budget));
        const std::size_t references = reference_count(tree);
        CHECK(static_cast<float>(references) <= (1.0f + budget) * 2000.0f);
        CHECK(static_cast<float>(references) > (1.0f + 0.5f * budget) * 1999.0f);
        CHECK(references > last);
        CHECK(tree.stats.sah_cost < last_cost);
        last = references;
        last_cost = tree.stats.sah_cost;
    }
}

TEST_CASE("without a budget the tree is the bvh's, to the byte") {
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        CAPTURE(kind.name);
        const TriangleMesh mesh = kind.make(5000, 3);
        BuildOptions plain = spatial_options(0.0f);
        const Tree tree = build_tree(mesh.view(), plain);
        plain.accel = AccelKind::kBvh;
        CHECK(are_same(tree, build_tree(mesh.view(), plain)));
    }
}

TEST_CASE("large triangles across each other cost less than in the bvh, the more may be cut") {
    const TriangleMesh mesh = make_diagonals(5000, 2);
    const double plain = build_tree(mesh.view(), {}).stats.sah_cost;
    CHECK(build_tree(mesh.view(), spatial_options(0.5f)).stats.sah_cost < 0.95 * plain);
    CHECK(build_tree(mesh.view(), spatial_options(4.0f)).stats.sah_cost < 0.5 * plain);
}

TEST_CASE("no scene costs more than in the bvh: where cuts would, it is that, to the byte") {
    std::size_t cut = 0, plain = 0;
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        for (const std::size_t triangles : {5000u, 20000u, 50000u}) {
            CAPTURE(kind.name);
            CAPTURE(triangles);
            const TriangleMesh mesh = kind.make(triangles, 3);
            BuildOptions options = spatial_options(0.5f);
            const Tree tree = build_tree(mesh.view(), options);
            options.accel = AccelKind::kBvh;
            const Tree bvh = build_tree(mesh.view(), options);
            const bool has_cuts = reference_count(tree) > reference_count(bvh);
            CHECK(tree.stats.sah_cost <= bvh.stats.sah_cost * (has_cuts ? 1.001 : 1.0));
            if (!has_cuts) CHECK(are_same(tree, bvh));
            ++(has_cuts ? cut : plain);
        }
    }
    CHECK(cut != 0);
    CHECK(plain != 0);
}

TEST_CASE("where the budget runs out does not depend on threads") {
    const TriangleMesh mesh = make_diagonals(60000, 4);
    BuildOptions options = spatial_options(0.2f);
    options.threads = 1;
    const Tree want = build_tree(mesh.view(), options);
    for (const int threads : {2, 8}) {
        options.threads = threads;
        for (int repeat = 0; repeat < 3; ++repeat) {
            CHECK(are_same(build_tree(mesh.view(), options), want));
        }
    }
}

TEST_CASE("a plane that costs least parts the references as it was said to") {
    const Parallel parallel(1);
    const TriangleMesh mesh = make_diagonals(500, 5);
    ScratchVector<Reference> references = collect_references(mesh.view(), parallel).items;
    const NodeRange node = whole_node(references, 700, parallel);
    const SpatialSplit split = find_spatial_split(mesh.view(), node, SahCosts({}), parallel, kAll);
    REQUIRE(split.axis >= 0);
    const auto halves = split_space(mesh.view(), node, split, 0, parallel);
    REQUIRE(halves.has_value());
    std::vector<int> seen(500, 0);
    for (int side = 0; side < 2; ++side) {
        const NodeRange& half = (*halves)[static_cast<std::size_t>(side)];
        CHECK(half.refs.size() <= static_cast<std::size_t>(split.count[side]));
        Bounds3f box;
        for (const Reference& r : half.refs) {
            CHECK(!r.bounds().empty());
            box.extend(r.bounds());
            ++seen[r.id];
        }
        CHECK(box == half.bounds.box);
        // The estimate is of parts of triangles, cut in slices rather than once.
        CHECK(half.bounds.box.half_area() < 1.01f * split.bounds[side].half_area());
    }
    for (const int count : seen) CHECK((count == 1 || count == 2));
    const auto& [below, above] = *halves;
    CHECK(below.refs.data() + below.capacity() == above.refs.data());
    CHECK(below.capacity() + above.capacity() == node.capacity());
}

TEST_CASE("a plane from a sample of many references is about the one from all of them") {
    const Parallel parallel(1);
    const TriangleMesh mesh = make_diagonals(40'000, 6);
    ScratchVector<Reference> references = collect_references(mesh.view(), parallel).items;
    const NodeRange node = whole_node(references, 20'000, parallel);
    const auto find = [&](std::size_t fewest_samples) {
        return find_spatial_split(mesh.view(), node, SahCosts({}), parallel, fewest_samples);
    };
    const SpatialSplit want = find(kAll), got = find(8192);
    REQUIRE(want.axis >= 0);
    REQUIRE(got.axis >= 0);
    CHECK(5.0f * got.cost == doctest::Approx(want.cost).epsilon(0.05));
    for (const float count : got.count) CHECK(count > 0.0f);
    CHECK(got.count[0] + got.count[1] ==
          doctest::Approx(want.count[0] + want.count[1]).epsilon(0.1));
    CHECK(got.count[0] + got.count[1] < 61'000.0f);
}

TEST_CASE("with less room than a plane cuts triangles, as many are cut as there is room") {
    const Parallel parallel(1);
    const TriangleMesh mesh = make_diagonals(500, 6);
    ScratchVector<Reference> references = collect_references(mesh.view(), parallel).items;
    NodeRange node = whole_node(references, 1000, parallel);
    const SpatialSplit split = find_spatial_split(mesh.view(), node, SahCosts({}), parallel, kAll);
    node.room = 3;
    const auto halves = split_space(mesh.view(), node, split, 0, parallel);
    REQUIRE(halves.has_value());
    CHECK((*halves)[0].refs.size() + (*halves)[1].refs.size() <= 503);
    CHECK((*halves)[0].capacity() + (*halves)[1].capacity() == 503);
}

TEST_CASE("a plane is none where the halves might not fit the depth") {
    const Parallel parallel(1);
    const TriangleMesh mesh = make_diagonals(500, 7);
    ScratchVector<Reference> references = collect_references(mesh.view(), parallel).items;
    const NodeRange node = whole_node(references, 500, parallel);
    const SpatialSplit split = find_spatial_split(mesh.view(), node, SahCosts({}), parallel, kAll);
    CHECK(!split_space(mesh.view(), node, split, kMaxDepth - 5, parallel).has_value());
}

TEST_CASE("triangles in the planes of slices, in one plane, and in one place") {
    TriangleMesh sheets, flat, same;
    for (int i = 0; i <= 16; ++i) {  // the planes between slices, exactly
        const auto x = static_cast<float>(i);
        for (int k = 0; k < 20; ++k) {
            add_triangle(sheets, {x, 0, 0}, {x, 16, 0}, {x, 0, 16});
            add_triangle(sheets, {0, x, 0}, {16, x, 0}, {0, x, 16});
        }
    }
    tools::Random random(8);
    for (int i = 0; i < 1000; ++i) {
        const auto point = [&] { return glm::vec3(random.uniform(), random.uniform(), 0.5f); };
        add_triangle(flat, point(), point(), point());
        add_triangle(same, {0, 0, 0}, {1, 1, 1}, {0, 1, 0.5f});
    }
    for (const TriangleMesh& mesh : {sheets, flat, same}) {
        for (const int size : {1, 8}) {
            BuildOptions options = spatial_options(8.0f);
            options.max_leaf_size = size;
            const Tree tree = build_tree(mesh.view(), options);  // asserts that it is valid
            CHECK(tree.stats.depth <= kMaxDepth);
            CHECK(reference_count(tree) >= mesh.triangles.size());
            CHECK(reference_count(tree) <= 9 * mesh.triangles.size());
        }
    }
}

TEST_CASE("budgets and qualities that are none are errors that name them") {
    const TriangleMesh mesh = tools::make_soup(10, 1);
    for (const float budget : {-0.1f, 8.1f, std::nanf("")}) {
        CHECK_THROWS_WITH_AS((void)build_tree(mesh.view(), spatial_options(budget)),
                             "BuildOptions::spatial_budget must be 0 to 8", Error);
    }
    BuildOptions options = spatial_options(0.5f);
    options.quality = BuildQuality::kHigh;
    CHECK_THROWS_WITH_AS((void)build_tree(mesh.view(), options),
                         "quality 'high' chooses how bvh is built; there is none of bvh-spatial",
                         Error);
    CHECK_THROWS_WITH_AS((void)parse_quality("best"),
                         "unknown quality 'best'; valid are: fast, balanced, high", Error);
}

TEST_CASE("a quality builds the tree of the structure that serves it") {
    const TriangleMesh mesh = tools::make_city(5000, 1);
    for (const QualityName& entry : quality_names()) {
        CAPTURE(entry.name);
        BuildOptions by_quality, by_name;
        by_quality.quality = parse_quality(entry.name);
        by_name.accel = chosen_accel(by_quality);
        CHECK(to_string(entry.quality) == entry.name);
        CHECK(are_same(build_tree(mesh.view(), by_quality), build_tree(mesh.view(), by_name)));
    }
    BuildOptions options;
    options.quality = BuildQuality::kFast;
    CHECK(chosen_accel(options) == AccelKind::kBvhMorton);
    options.quality = BuildQuality::kHigh;
    CHECK(chosen_accel(options) == AccelKind::kBvhSpatial);
}
