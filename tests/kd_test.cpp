// Trees of cells, k-d trees above all: how triangles are cut, and that cutting them changes no hit.
#include "configurations.h"
#include "generate.h"
#include "test_rays.h"

#include "build/clip.h"
#include "build/kd_events.h"
#include "build/kd_tree.h"
#include "build/tree.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace packet;
using namespace packet::test;

namespace {

using Corners = glm::vec3[3];

/// The bounds of the points of a triangle in a box, from below: of random ones in the triangle.
Bounds3f sampled_bounds(const Corners& v, const Bounds3f& box, tools::Random& random) {
    Bounds3f out;
    for (int i = 0; i < 400; ++i) {
        double b = static_cast<double>(random.uniform()), c = static_cast<double>(random.uniform());
        if (b + c > 1.0) b = 1.0 - b, c = 1.0 - c;
        const glm::vec3 p((1.0 - b - c) * glm::dvec3(v[0]) + b * glm::dvec3(v[1]) +
                          c * glm::dvec3(v[2]));
        if (box.contains({p, p})) out.extend(p);
    }
    return out;
}

Bounds3f random_box(tools::Random& random) {
    const glm::vec3 a = random.point(), b = random.point();
    return {glm::min(a, b), glm::max(a, b)};
}

/// The rays, each also ending, starting, and starting and ending exactly where it hits, so that a
/// box that is entered an ulp too late or left an ulp too early loses the hit.
std::vector<Ray> pinned_to_hits(const TriangleMesh& mesh, std::vector<Ray> rays) {
    const std::vector<Hit> hits = Oracle(make_scene(mesh)).closest(rays);
    for (std::size_t i = 0; i < hits.size(); ++i) {
        if (!hits[i].is_hit()) continue;
        Ray ends = rays[i], starts = rays[i], both = rays[i];
        ends.tfar = both.tfar = hits[i].t;
        starts.tnear = both.tnear = hits[i].t;
        rays.insert(rays.end(), {ends, starts, both});
    }
    return rays;
}

void check_pinned(const TriangleMesh& mesh, std::vector<Ray> rays, const std::string& label) {
    check_agreement(make_scene(mesh), pinned_to_hits(mesh, std::move(rays)), label);
}

void add_triangle(TriangleMesh& mesh, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c});
    mesh.triangles.push_back({first, first + 1, first + 2});
}

std::size_t reference_count(const Tree& tree) {
    std::size_t count = 0;
    for (const Node& node : tree.nodes) count += node.count;
    return count;
}

/// Boxes on a coarse lattice, so that many begin, end or are flat in one plane; some leave gaps.
KdCell random_cell(tools::Random& random, const Parallel& parallel) {
    KdCell cell;
    const std::uint64_t count = 2 + random.next() % 30;
    for (std::uint32_t id = 0; id < count; ++id) {
        const glm::vec3 lower = glm::floor(12.0f * random.point());
        const glm::vec3 upper = lower + glm::floor(2.5f * random.point());
        cell.references.push_back({lower, id, upper});
        cell.bounds.extend({lower, upper});
    }
    cell.events = make_events(cell.references, parallel);
    cell.spare = random.next() % 20;
    return cell;
}

/// The least cost over all planes, each from a look at every reference.
double cheapest_cost(const KdCell& cell, const BuildOptions& options) {
    const KdCost cost(cell, options);
    double best = cost.leaf();
    for (int i = 0; i < 12 * static_cast<int>(cell.references.size()); ++i) {
        const Reference& at = cell.references[static_cast<std::size_t>(i / 12)];
        const int axis = i % 3;
        const float position = i / 6 % 2 == 0 ? at.lower[axis] : at.upper[axis];
        const KdPlane plane{0.0, position, axis, i / 3 % 2};
        KdCounts counts;
        float end = -INFINITY, begin = INFINITY;
        for (const Reference& r : cell.references) {
            const int side = plane.side_of(r);
            if (side != 1) ++counts.side[0], end = std::max(end, r.upper[axis]);
            if (side != 0) ++counts.side[1], begin = std::min(begin, r.lower[axis]);
        }
        if (!counts.allow_cut(cell)) continue;
        end = std::min(end, plane.position), begin = std::max(begin, plane.position);
        best = std::min(best, cost.cut(axis, end, begin, counts));
    }
    return best;
}

/// Every tree of cells, in each way that it is built.
std::vector<Build> cell_trees() {
    std::vector<Build> out = all_builds();
    std::erase_if(out, [](const Build& build) {
        constexpr AccelKind kKinds[] = {AccelKind::kKdMidpoint, AccelKind::kKdMedian,
                                        AccelKind::kKdSah, AccelKind::kOctree};
        return std::find(std::begin(kKinds), std::end(kKinds), build.options.accel) ==
               std::end(kKinds);
    });
    return out;
}

}  // namespace

TEST_CASE("a clipped triangle's box is where the triangle is, an ulp larger at most") {
    const Corners v = {{0, 0, 0}, {4, 0, 0}, {0, 4, 2}};
    const auto check = [&](const Bounds3f& box, const Bounds3f& want) {
        const Bounds3f got = clip_triangle(v, box);
        const glm::vec3 ulp(4.0f / 8388608.0f);  // of 4
        CHECK(got.contains(want));
        CHECK(Bounds3f{want.lower - ulp, want.upper + ulp}.contains(got));
        CHECK(box.contains(got));
    };
    check({{-1, -1, -1}, {5, 5, 5}}, {{0, 0, 0}, {4, 4, 2}});
    check({{0, 0, 0}, {4, 4, 2}}, {{0, 0, 0}, {4, 4, 2}});
    check({{1, 1, -1}, {5, 5, 5}}, {{1, 1, 0.5f}, {3, 3, 1.5f}});
    check({{0, 0, 1}, {5, 5, 5}}, {{0, 2, 1}, {2, 4, 2}});
    check({{2, 2, -1}, {5, 5, 5}}, {{2, 2, 1}, {2, 2, 1}});       // a point
    CHECK(clip_triangle(v, {{2.5f, 2, -1}, {5, 5, 5}}).empty());  // its box is met, itself not
}

TEST_CASE("no point of a triangle is outside its clipped box, which is no larger than need be") {
    tools::Random random(5);
    double excess = 0.0;
    for (int i = 0; i < 2000; ++i) {
        const Corners v = {random.point(), random.point(), random.point()};
        const Bounds3f box = random_box(random);
        const Bounds3f got = clip_triangle(v, box);
        const Bounds3f inner = sampled_bounds(v, box, random);
        if (inner.empty()) continue;
        REQUIRE(got.contains(inner));
        REQUIRE(box.contains(got));
        for (int a = 0; a < 3; ++a) {
            excess += static_cast<double>(got.extent()[a] - inner.extent()[a]);
        }
    }
    CHECK(excess / 2000.0 < 0.06);  // the unclipped boxes in the box would exceed by 0.3
}

TEST_CASE("both parts of a cut triangle meet at the plane and lose none of it") {
    tools::Random random(6);
    for (int i = 0; i < 2000; ++i) {
        TriangleMesh mesh;
        // Slivers too, and sizes as different as meshes are.
        const float size = std::ldexp(1.0f, static_cast<int>(random.uniform(-45.0f, 45.0f)));
        const glm::vec3 p = size * random.point(), along = size * random.direction();
        add_triangle(mesh, p, p + along, p + 0.3f * along + 1e-6f * size * random.direction());
        Bounds3f box;
        for (const glm::vec3& corner : mesh.positions) box.extend(corner);
        const int axis = i % 3;
        const float at = box.center()[axis];
        if (!(box.lower[axis] < at && at < box.upper[axis])) continue;
        const CutReference cut = cut_reference(mesh.view(), {box.lower, 0, box.upper}, axis, at);
        CHECK(cut.side[0].upper[axis] == at);
        CHECK(cut.side[1].lower[axis] == at);
        Bounds3f both = cut.side[0].bounds();
        both.extend(cut.side[1].bounds());
        CHECK(both == box);
        const Corners v = {mesh.positions[0], mesh.positions[1], mesh.positions[2]};
        Bounds3f below = box;
        below.upper[axis] = at;
        CHECK(cut.side[0].bounds() == clip_triangle(v, below));
    }
}

TEST_CASE("the sweep over sorted events finds what trying every plane finds") {
    tools::Random random(8);
    const Parallel parallel(1);
    const BuildOptions options;
    int cuts = 0;
    for (int i = 0; i < 3000; ++i) {
        const KdCell cell = random_cell(random, parallel);
        const KdPlane plane = find_cheapest_plane(cell, options, parallel);
        CHECK(plane.cost == cheapest_cost(cell, options));
        cuts += plane.is_cut();
    }
    CHECK(cuts > 1000);
}

TEST_CASE("events handed down are those that the children would have sorted anew") {
    const Parallel parallel(1);
    const TriangleMesh mesh = tools::make_soup(300, 9);
    KdCell cell;
    cell.references = collect_references(mesh.view(), parallel).items;
    for (const Reference& r : cell.references) cell.bounds.extend(r.bounds());
    cell.events = make_events(cell.references, parallel);
    cell.spare = 1000;
    for (int axis = 0; axis < 3; ++axis) {
        const KdPlane plane{0.0, cell.bounds.center()[axis], axis, 0};
        KdChildren children = cut_cell(mesh.view(), cell, plane, parallel);
        CHECK(children.whole[0] < children.cell[0].references.size());
        split_events(cell.events, children, parallel);
        for (const KdCell& child : children.cell) {
            CHECK(child.events == make_events(child.references, parallel));
        }
    }
}

TEST_CASE("the reference cap holds, is used, and leaves every triangle in the tree") {
    TriangleMesh mesh;
    tools::Random random(7);
    for (int i = 0; i < 2000; ++i) {  // long and thin, each across the whole scene
        const glm::vec3 p = random.point(), q = random.point();
        add_triangle(mesh, p, q, q + 0.001f * random.direction());
    }
    for (const Build& build : cell_trees()) {
        CAPTURE(build.name);
        std::size_t last = 0;
        for (const float factor : {1.0f, 3.0f, 10.0f, 64.0f}) {
            BuildOptions options = build.options;
            options.max_reference_factor = factor;
            const std::size_t references = reference_count(build_tree(mesh.view(), options));
            CHECK(static_cast<float>(references) <= factor * 2000.0f);
            CHECK((references > last || factor == 64.0f));
            last = references;
            if (factor == 1.0f) CHECK(references == 2000);
        }
    }
    BuildOptions options;
    options.max_reference_factor = 0.5f;
    CHECK_THROWS_WITH_AS((void)build_tree(mesh.view(), options),
                         "BuildOptions::max_reference_factor must be 1 to 64", Error);
}

TEST_CASE("a fan about one vertex, which no plane parts, ends in leaves as small as asked") {
    TriangleMesh mesh;
    for (int i = 0; i < 3000; ++i) {
        const float x = static_cast<float>(i) / 3000.0f, y = x + 1.0f / 3000.0f;
        add_triangle(mesh, {0, 0, 0}, {1 - x, x, 1}, {1 - y, y, 1});
    }
    for (const Build& build : cell_trees()) {
        CAPTURE(build.name);
        BuildOptions options = build.options;
        options.max_leaf_size = 4;
        const Tree tree = build_tree(mesh.view(), options);
        CHECK(tree.stats.depth <= kMaxDepth);
        for (const Node& node : tree.nodes) CHECK(node.count <= 4);
    }
}

TEST_CASE("inner nodes have two children that hold something, and empty space is in none") {
    TriangleMesh mesh;  // two far clusters: all between them is empty
    for (const float x : {0.0f, 1000.0f}) {
        for (int i = 0; i < 64; ++i) {
            const float y = static_cast<float>(i);
            add_triangle(mesh, {x, y, 0}, {x + 1, y, 0}, {x, y + 1, 0});
        }
    }
    for (const Build& build : cell_trees()) {
        CAPTURE(build.name);
        const Tree tree = build_tree(mesh.view(), build.options);
        CHECK(tree.stats.leaf_count == (tree.stats.node_count + 1) / 2);
        for (const Node& node : tree.nodes) {
            if (node.is_leaf()) CHECK(node.plane[1][0] - node.plane[0][0] <= 1.0f);
        }
    }
}

TEST_CASE("the surface area heuristic's k-d tree is better than the others") {
    const TriangleMesh mesh = tools::make_city(20000, 5);
    const auto cost = [&](AccelKind kind) {
        BuildOptions options;
        options.accel = kind;
        return build_tree(mesh.view(), options).stats.sah_cost;
    };
    const double sah = cost(AccelKind::kKdSah);
    CHECK(sah < cost(AccelKind::kKdMidpoint));
    CHECK(sah < cost(AccelKind::kKdMedian));
}

TEST_SUITE_BEGIN("agreement");

TEST_CASE("long thin triangles across many cells, with rays pinned to their hits") {
    tools::Random random(11);
    TriangleMesh mesh;
    for (int i = 0; i < 300; ++i) {
        const glm::vec3 p = random.point(), q = random.point();
        add_triangle(mesh, p, q, q + 0.01f * random.direction());
    }
    for (int i = 0; i < 1000; ++i) {
        const glm::vec3 p = random.point();
        add_triangle(mesh, p, p + 0.02f * random.direction(), p + 0.02f * random.direction());
    }
    auto rays = random_rays({{0, 0, 0}, {1, 1, 1}}, 1024, 12);
    const auto aimed = aim_at_features({0.5f, 0.4f, -2.0f}, mesh.view());
    rays.insert(rays.end(), aimed.begin(), aimed.end());
    check_pinned(mesh, rays, "long thin triangles");
}

TEST_CASE("triangles that lie in the planes of cells, with rays in and along them") {
    TriangleMesh mesh;
    for (int axis = 0; axis < 3; ++axis) {
        for (int plane = 0; plane <= 8; ++plane) {
            glm::vec3 origin(0.0f), u(0.0f), v(0.0f);
            origin[axis] = static_cast<float>(plane);
            u[(axis + 1) % 3] = v[(axis + 2) % 3] = 2.0f;
            const TriangleMesh sheet = make_grid(4, 4, origin, u, v);
            const auto offset = static_cast<std::uint32_t>(mesh.positions.size());
            mesh.positions.insert(mesh.positions.end(), sheet.positions.begin(),
                                  sheet.positions.end());
            for (const glm::uvec3& t : sheet.triangles) mesh.triangles.push_back(t + offset);
        }
    }
    tools::Random random(13);
    std::vector<Ray> rays = random_rays({{0, 0, 0}, {8, 8, 8}}, 1024, 14);
    for (int i = 0; i < 3000; ++i) {  // from and to points of the lattice, or very near them
        const auto lattice = [&] { return glm::round(16.0f * random.point()) / 2.0f; };
        const glm::vec3 from = lattice(), to = lattice();
        rays.push_back(aim(from, to + static_cast<float>(i % 4) * 1e-7f * random.direction()));
    }
    check_pinned(mesh, rays, "sheets");
}

TEST_CASE("rays that graze large triangles, pinned to their hits") {
    for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
        tools::Random random(seed);
        TriangleMesh mesh;
        for (int i = 0; i < 40; ++i) {
            add_triangle(mesh, 2.0f * random.point() - 0.5f, 2.0f * random.point() - 0.5f,
                         2.0f * random.point() - 0.5f);
        }
        for (int i = 0; i < 400; ++i) {  // small ones make small cells
            const glm::vec3 p = random.point();
            add_triangle(mesh, p, p + 0.05f * random.direction(), p + 0.05f * random.direction());
        }
        std::vector<Ray> rays;
        for (int i = 0; i < 4000; ++i) {  // in a triangle's plane, but for an error
            const glm::uvec3 t = mesh.triangles[static_cast<std::size_t>(i) % 40];
            const glm::vec3 e1 = mesh.positions[t.y] - mesh.positions[t.x];
            const glm::vec3 e2 = mesh.positions[t.z] - mesh.positions[t.x];
            const glm::vec3 inside = mesh.positions[t.x] + random.uniform(0.05f, 0.45f) * e1 +
                                     random.uniform(0.05f, 0.45f) * e2;
            const glm::vec3 along =
                random.uniform(-1.0f, 1.0f) * e1 + random.uniform(-1.0f, 1.0f) * e2;
            const float tilt = std::ldexp(1.0f, static_cast<int>(random.uniform(-26.0f, -6.0f)));
            const glm::vec3 dir = along + tilt * random.direction();
            Ray ray;
            ray.org = inside - random.uniform(0.0f, 2.0f) * dir;
            ray.dir = dir;
            rays.push_back(ray);
        }
        check_pinned(mesh, rays, "grazing, seed " + std::to_string(seed));
    }
}

// For such a ray barycentric coordinates rounded in float put t far from where ray and triangle
// meet, up to 2.6e5 times the growth of boxes. The box of the part that the ray meets would be
// entered after t, and a hit, or the ray's end, in between would make the walk stop early.
TEST_CASE("rays that all but lie in a large triangle's plane, among dust") {
    for (const std::uint64_t seed : {3u, 4u, 5u, 6u}) {
        tools::Random random(seed);
        TriangleMesh mesh;
        const glm::vec3 p = 2.0f * random.point() - 0.5f;
        const glm::vec3 e1 = random.direction(), e2 = random.direction();
        add_triangle(mesh, p, p + e1, p + e2);
        const auto inside = [&] {
            return p + random.uniform(0.05f, 0.45f) * e1 + random.uniform(0.05f, 0.45f) * e2;
        };
        for (int i = 0; i < 2000; ++i) {
            const glm::vec3 q = inside() + 0.02f * random.direction();
            add_triangle(mesh, q, q + 0.003f * random.direction(), q + 0.003f * random.direction());
        }
        std::vector<Ray> rays;
        for (int i = 0; i < 8000; ++i) {
            const float tilt = std::ldexp(1.0f, static_cast<int>(random.uniform(-26.0f, -14.0f)));
            Ray ray;
            ray.dir = random.uniform(-1.0f, 1.0f) * e1 + random.uniform(-1.0f, 1.0f) * e2 +
                      tilt * random.direction();
            ray.org = inside() - random.uniform(0.0f, 2.0f) * ray.dir;
            rays.push_back(ray);
        }
        check_pinned(mesh, rays, "dust, seed " + std::to_string(seed));
    }
}

TEST_CASE("sizes from 1e-15 to 1e15 and far from the origin, pinned") {
    for (const float scale : {1e-15f, 1e-6f, 1.0f, 1e6f, 1e15f}) {
        for (const float shift : {0.0f, 30.0f, 3000.0f}) {
            TriangleMesh mesh = tools::make_soup(300, 21);
            for (glm::vec3& p : mesh.positions) p = scale * (p + shift * glm::vec3(1, -0.7f, 0.3f));
            const Bounds3f box = make_scene(mesh).bounds();
            check_pinned(mesh, random_rays(box, 512, 22),
                         "scale " + std::to_string(scale) + " shift " + std::to_string(shift));
        }
    }
}

TEST_SUITE_END();
