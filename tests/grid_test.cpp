// Grids: how space is cut, which cells refer to a triangle, and that rays at the borders of cells
// lose nothing.
#include "configurations.h"
#include "generate.h"
#include "oracle.h"
#include "share.h"
#include "test_rays.h"

#include "build/grid_references.h"
#include "build/overlap.h"
#include "build/uniform_grid.h"
#include "kernels/counters.h"
#include "kernels/grid_walk.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

using namespace packet;
using namespace packet::test;

namespace {

Bounds3f box_of(const glm::vec3& extent) { return {glm::vec3(0.0f), extent}; }

void check_sides(const glm::vec3& extent, double cells, const glm::ivec3& want) {
    const GridSpace space(box_of(extent), cells);
    CHECK(glm::ivec3(space.side(0), space.side(1), space.side(2)) == want);
}

ScratchVector<Reference> references_of(const TriangleMesh& mesh) {
    return collect_references(mesh.view(), Parallel(1)).items;
}

CellLists sort_cells(const TriangleMesh& mesh, double density, int threads,
                     const BuildOptions& options = {}) {
    const Parallel parallel(threads);
    CellLists out{GridSpace(box_of(glm::vec3(1.0f)), 1.0), {}, {}};
    parallel.run([&] {
        out = sort_into_cells(mesh.view(), references_of(mesh), density, options, parallel);
    });
    return out;
}

/// Cells that share more than a face with the triangle's box, or the upper of two if all they share
/// is a face, and that the triangle overlaps: told by looking at every cell.
std::vector<std::uint32_t> naive_cells(const GridSpace& space, const glm::vec3 (&v)[3]) {
    Bounds3f box;
    for (const glm::vec3& p : v) box.extend(p);
    std::vector<std::uint32_t> out;
    for (int z = 0; z < space.side(2); ++z) {
        for (int y = 0; y < space.side(1); ++y) {
            for (int x = 0; x < space.side(0); ++x) {
                const int at[3] = {x, y, z};
                const Bounds3f cell = space.box_of({{x, y, z}, {x, y, z}});
                bool reached = overlaps_by_axes(v, cell);
                for (int a = 0; a < 3; ++a) {
                    const bool is_last = at[a] + 1 == space.side(a);
                    if (cell.upper[a] == box.lower[a] && !is_last) reached = false;
                    if (cell.lower[a] == box.upper[a] && cell.lower[a] != box.lower[a]) {
                        reached = false;
                    }
                }
                if (reached) out.push_back(space.cell_id(x, y, z));
            }
        }
    }
    return out;
}

void check_against_naive(const TriangleMesh& mesh, double density) {
    const CellLists cells = sort_cells(mesh, density, 1);
    std::set<std::pair<std::uint32_t, std::uint32_t>> want, got;
    for (const Reference& r : references_of(mesh)) {
        const glm::uvec3 t = mesh.triangles[r.id];
        const glm::vec3 v[3] = {mesh.positions[t.x], mesh.positions[t.y], mesh.positions[t.z]};
        for (const std::uint32_t cell : naive_cells(cells.space, v)) want.insert({cell, r.id});
    }
    std::size_t end = 0;
    for (const CellList& list : cells.lists) {
        CHECK(list.first == end);
        end = list.first + list.count;
        for (std::size_t i = list.first; i < end; ++i) got.insert({list.cell, cells.ids[i]});
        CHECK(std::is_sorted(cells.ids.begin() + list.first,
                             cells.ids.begin() + static_cast<std::ptrdiff_t>(end)));
    }
    CHECK(end == cells.ids.size());
    CHECK(got.size() == cells.ids.size());
    CHECK(got == want);
    CHECK(std::is_sorted(cells.lists.begin(), cells.lists.end(),
                         [](const CellList& a, const CellList& b) { return a.cell < b.cell; }));
}

using Lane = isa::Scalar;

/// A ray before the cells of a grid that holds something in each, and what is true of a cell.
struct MarchCase {
    Grid grid;
    TreeView tree;
    RayLanes<1, Lane> ray;
    PreparedRays<1, Lane> prepared;
    SingleRay single;
    float tfar;

    MarchCase(const GridSpace& space, const Ray& source) : tfar(source.tfar) {
        for (int a = 0; a < 3; ++a) {
            grid.planes[a] = space.planes(a);
            grid.brick_count[a] = space.brick_side(a);
            grid.bricks_per_unit[a] = space.bricks_per_unit(a);
            ray.org[a] = source.org[a], ray.dir[a] = source.dir[a];
            tree.lower[a] = space.bounds().lower[a], tree.upper[a] = space.bounds().upper[a];
        }
        ray.tnear = source.tnear, ray.tfar = source.tfar;
        grid.bricks.resize(space.brick_count(), {~std::uint64_t{0}, 0, 0});
        tree.grid = grid.view();
        prepare_boxes(prepared, tree, ray);
        packet::prepare(single, tree, RayAxes<Lane>(source));
    }

    struct Interval {
        float enter, exit;
    };
    [[nodiscard]] Interval meet(const int (&first)[3], int side) const {
        const glm::vec3 lower(plane(0, first[0]), plane(1, first[1]), plane(2, first[2]));
        const glm::vec3 upper(plane(0, first[0] + side), plane(1, first[1] + side),
                              plane(2, first[2] + side));
        const Float<1, Lane> low[3] = {lower.x, lower.y, lower.z};
        const Float<1, Lane> high[3] = {upper.x, upper.y, upper.z};
        const auto box = slabs(prepared.hit, low, high);
        return {std::max(box.enter.r[0], ray.tnear.r[0]), std::min(box.exit.r[0], tfar)};
    }

    /// Cells as the march meets them: places along x, y, z.
    [[nodiscard]] std::vector<std::tuple<int, int, int>> march_all() const {
        std::vector<std::tuple<int, int, int>> out;
        const GridRay<Lane> way(tree.grid, single, -INFINITY);
        NoCounters stats(nullptr);
        if (!(way.start <= tfar)) return out;
        march_grid(tree.grid, way, tfar, stats, [&](const GridBrick& brick, std::uint32_t bit) {
            auto b = static_cast<int>(&brick - grid.bricks.data());
            int at[3];
            for (int a = 0; a < 3; ++a) {
                at[a] = b % grid.brick_count[a] * kBrickSide + static_cast<int>(bit >> 2 * a & 3);
                b /= grid.brick_count[a];
            }
            out.emplace_back(at[0], at[1], at[2]);
        });
        return out;
    }

private:
    [[nodiscard]] float plane(int axis, int i) const {
        return grid.planes[axis][static_cast<std::size_t>(i)];
    }
};

/// Returns the number of cells met.
std::size_t check_march(const GridSpace& space, const Ray& ray) {
    const MarchCase march(space, ray);
    std::set<std::tuple<int, int, int>> want;
    int at[3];
    for (at[2] = 0; at[2] < 4 * space.brick_side(2); ++at[2]) {
        for (at[1] = 0; at[1] < 4 * space.brick_side(1); ++at[1]) {
            for (at[0] = 0; at[0] < 4 * space.brick_side(0); ++at[0]) {
                const auto cell = march.meet(at, 1);
                if (cell.enter <= cell.exit) want.insert({at[0], at[1], at[2]});
            }
        }
    }
    const auto got = march.march_all();
    CHECK(got.size() == want.size());  // each once
    CHECK(std::set(got.begin(), got.end()) == want);
    std::set<std::tuple<int, int, int>> seen;
    float last_brick = -INFINITY, last_cell = -INFINITY;
    for (const auto& [x, y, z] : got) {
        const int cell[3] = {x, y, z}, brick[3] = {x / 4 * 4, y / 4 * 4, z / 4 * 4};
        const float brick_enter = march.meet(brick, 4).enter, enter = march.meet(cell, 1).enter;
        CHECK(brick_enter >= last_brick);
        // Bricks that are entered at once may follow each other's cells.
        if (brick_enter == last_brick && seen.contains({brick[0], brick[1], brick[2]})) {
            CHECK(enter >= last_cell);
        }
        seen.insert({brick[0], brick[1], brick[2]});
        last_brick = brick_enter, last_cell = enter;
    }
    return got.size();
}

}  // namespace

TEST_CASE("cells are near to cubes, and thin boxes are cut along their long axes only") {
    check_sides({1, 1, 1}, 1, {1, 1, 1});
    check_sides({1, 1, 1}, 1000, {10, 10, 10});
    check_sides({4, 2, 1}, 8000, {40, 20, 10});
    check_sides({1, 0, 1}, 10000, {100, 1, 100});
    check_sides({1, 1e-3f, 1}, 10000, {100, 1, 100});
    check_sides({0, 1, 0}, 100, {1, 100, 1});
    check_sides({1e-3f, 1, 1e-3f}, 100, {1, 100, 1});
    check_sides({0, 0, 0}, 1e6, {1, 1, 1});
    check_sides({1e15f, 1e15f, 1e15f}, 27, {3, 3, 3});
    check_sides({1e-15f, 1e-15f, 1e-15f}, 27, {3, 3, 3});
    // Hostile numbers of cells are bounded.
    const GridSpace line(box_of({1, 0, 0}), 1e9), huge(box_of({1, 1, 1}), 1e12);
    CHECK(line.side(0) == 16384);
    CHECK(huge.brick_count() <= std::size_t{1} << 26);
}

TEST_CASE("planes ascend from face to face, and every number of a cell names that cell") {
    for (const float scale : {1e-15f, 1.0f, 1e15f}) {
        for (const glm::vec3 at : {glm::vec3(0), glm::vec3(1e3f, -2e5f, 3.0f)}) {
            const Bounds3f box{scale * at, scale * (at + glm::vec3(3, 2, 1))};
            const GridSpace space(box, 1000);
            std::set<std::uint32_t> ids;
            for (int a = 0; a < 3; ++a) {
                const auto& planes = space.planes(a);
                CHECK(std::is_sorted(planes.begin(), planes.end()));
                CHECK(planes.front() == box.lower[a]);
                CHECK(planes[static_cast<std::size_t>(space.side(a))] == box.upper[a]);
                CHECK(planes.back() == box.upper[a]);
                CHECK(planes.size() == static_cast<std::size_t>(4 * space.brick_side(a) + 1));
            }
            for (int z = 0; z < space.side(2); ++z) {
                for (int y = 0; y < space.side(1); ++y) {
                    for (int x = 0; x < space.side(0); ++x) {
                        const std::uint32_t id = space.cell_id(x, y, z);
                        CHECK(id < 64 * space.brick_count());
                        ids.insert(id);
                    }
                }
            }
            CHECK(ids.size() == space.cell_count());
        }
    }
}

TEST_CASE("cells refer to the triangles that overlap them, in order, as a naive search finds") {
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        for (const double density : {0.25, 2.0, 8.0}) {
            CAPTURE(kind.name);
            CAPTURE(density);
            check_against_naive(kind.make(300, 4), density);
        }
    }
    TriangleMesh large;  // across many cells
    tools::Random random(3);
    for (std::uint32_t i = 0; i < 60; ++i) {
        large.positions.insert(large.positions.end(),
                               {random.point(), random.point(), random.point()});
        large.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    check_against_naive(large, 16.0);
    // In planes of cells: a lattice whose planes are those of the grid.
    TriangleMesh lattice = make_grid(8, 8, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    for (int z = 1; z <= 8; ++z) {
        const TriangleMesh sheet =
            make_grid(8, 8, {0, 0, static_cast<float>(z)}, {1, 0, 0}, {0, 1, 0});
        const auto offset = static_cast<std::uint32_t>(lattice.positions.size());
        lattice.positions.insert(lattice.positions.end(), sheet.positions.begin(),
                                 sheet.positions.end());
        for (const glm::uvec3& t : sheet.triangles) lattice.triangles.push_back(t + offset);
    }
    check_against_naive(lattice, 512.0 / 1152.0);
}

TEST_CASE("the march meets the cells whose grown boxes the ray meets, each once, nearest first") {
    tools::Random random(17);
    std::size_t met = 0;
    for (const float scale : {1e-15f, 1.0f, 1e15f}) {
        for (const float shift : {0.0f, 1.0f, 1e4f}) {
            const glm::vec3 lower = scale * shift * glm::vec3(1.0f, -0.7f, 0.3f);
            const Bounds3f box{lower, lower + scale * glm::vec3(8, 6, 4)};
            const GridSpace space(box, 8 * 6 * 4);
            for (int i = 0; i < 600; ++i) {
                // Corners, edges and faces of cells, and any points: as many as numbers allow are
                // on planes, and the ray runs from and to such points, along them, and from afar.
                const auto point = [&] {
                    glm::vec3 p;
                    for (int a = 0; a < 3; ++a) {
                        const auto& planes = space.planes(a);
                        p[a] = random.next() % 3 != 0 ? planes[random.next() % planes.size()]
                                                      : random.uniform(box.lower[a], box.upper[a]);
                    }
                    return p;
                };
                Ray ray = aim(point(), point());
                if (ray.dir == glm::vec3(0.0f)) continue;
                if (i % 3 == 0) ray.org -= 3.0f * ray.dir;
                if (i % 7 == 0) ray.org -= 1e5f * ray.dir;
                if (i % 11 == 0) ray.dir[i % 3] = i % 2 == 0 ? 0.0f : -0.0f;
                if (i % 13 == 0) ray.dir = glm::vec3(0, i % 2 == 0 ? scale : -scale, 0);
                if (i % 5 == 0) ray.dir[i % 3] *= 1e-7f;
                if (ray.dir == glm::vec3(0.0f)) continue;
                ray.tfar = i % 4 == 0 ? random.uniform(0.0f, 4.0f) : 3e38f;
                ray.tnear = i % 8 < 2 ? 0.0f : i % 8 == 2 ? random.uniform() : -3e38f;
                met += check_march(space, ray);
            }
        }
    }
    CHECK(met > 20000);
}

TEST_CASE("lists are the same for any number of threads") {
    const TriangleMesh mesh = tools::make_city(60000, 5);
    const CellLists want = sort_cells(mesh, 2.0, 1);
    for (const int threads : {2, 8}) {
        const CellLists got = sort_cells(mesh, 2.0, threads);
        CHECK(got.ids == want.ids);
        CHECK(std::equal(got.lists.begin(), got.lists.end(), want.lists.begin(), want.lists.end(),
                         [](const CellList& a, const CellList& b) {
                             return a.cell == b.cell && a.first == b.first && a.count == b.count;
                         }));
    }
}

TEST_CASE("the cap on references holds, and coarsens the grid as far as it must") {
    TriangleMesh mesh;
    tools::Random random(7);
    for (std::uint32_t i = 0; i < 2000; ++i) {  // long and thin, each across the whole scene
        const glm::vec3 p = random.point(), q = random.point();
        mesh.positions.insert(mesh.positions.end(), {p, q, q + 0.001f * random.direction()});
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    std::size_t last = 0;
    for (const float factor : {1.0f, 4.0f, 64.0f}) {
        BuildOptions options;
        options.max_reference_factor = factor;
        const CellLists cells = sort_cells(mesh, 4.0, 2, options);
        CHECK(static_cast<float>(cells.ids.size()) <= factor * 2000.0f);
        CHECK(cells.ids.size() > last);
        last = cells.ids.size();
        if (factor == 1.0f) CHECK(cells.space.cell_count() == 1);
    }
}

TEST_CASE("a sample of many triangles coarsens the grid no further than all of them would") {
    const TriangleMesh mesh = tools::make_soup(70'000, 3);
    const double limit = 3.0 * 70'000;
    BuildOptions capped, free;
    capped.max_reference_factor = 3.0f;
    free.max_reference_factor = 64.0f;
    const CellLists cells = sort_cells(mesh, 8.0, 2, capped);
    CHECK(static_cast<double>(cells.ids.size()) <= limit);
    double density = 8.0;
    while (static_cast<double>(sort_cells(mesh, density, 2, free).ids.size()) > limit) {
        density *= 0.5;
    }
    CHECK(density < 8.0);
    CHECK(cells.ids == sort_cells(mesh, density, 2, free).ids);
}

TEST_CASE("hostile meshes build at once, and into little memory") {
    const auto check = [](const TriangleMesh& mesh) {
        for (const AccelKind kind : {AccelKind::kGrid, AccelKind::kGridOfTrees}) {
            BuildOptions options;
            options.accel = kind;
            options.grid_density = 64.0f;
            const Tree tree = build_tree(mesh.view(), options);
            CHECK(tree.stats.seconds < 5.0 / test_share());  // sanitizers are slow
            CHECK(tree.stats.bytes < 1000 * mesh.triangles.size() + 1'000'000);
        }
    };
    TriangleMesh same;
    same.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    same.triangles = {{0, 1, 2}};
    check(same);
    same.triangles.assign(100000, {0, 1, 2});
    check(same);
    same.positions = {{0, 0, 0}, {1, 0.3f, 0.2f}, {0.1f, 1, 1}};
    check(same);
    TriangleMesh line;  // thin, and far longer than wide
    for (std::uint32_t i = 0; i < 100000; ++i) {
        const auto x = static_cast<float>(i);
        line.positions.insert(line.positions.end(),
                              {{x, 0, 0}, {x + 1, 0, 0}, {x, 1e-15f, 1e-15f}});
        line.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    check(line);
    for (const float size : {1e-15f, 1e15f}) {
        TriangleMesh far = tools::make_soup(1000, 2);
        for (glm::vec3& p : far.positions) p = size * (p + 1.0f);
        far.positions.insert(far.positions.end(), {{0, 0, 0}, {1e-15f, 0, 0}, {0, 1e-15f, 0}});
        far.triangles.push_back({3000, 3001, 3002});
        check(far);
    }
    TriangleMesh huge = tools::make_terrain(20000, 1);  // small ones, and some across all
    for (std::uint32_t i = 0; i < 500; ++i) huge.triangles.push_back({0, 10000, 5000u + i});
    check(huge);
}

TEST_CASE("options out of range are errors that name them") {
    const TriangleMesh mesh = tools::make_soup(10, 1);
    for (const float bad : {0.0f, 0.01f, 65.0f, std::nanf("")}) {
        BuildOptions options;
        options.grid_density = bad;
        CHECK_THROWS_WITH_AS((void)build_tree(mesh.view(), options),
                             "BuildOptions::grid_density must be 1/64 to 64", Error);
    }
}

TEST_CASE("a grid of trees traces a teapot in a stadium with less work than a grid") {
    const glm::vec3 pot(0.0f, 0.7f, 0.0f);
    std::vector<Ray> rays;
    tools::Random random(5);
    for (int i = 0; i < 1000; ++i) {
        const glm::vec3 target = pot + random.direction();
        rays.push_back(aim(pot + 5.0f * random.direction(), target));
    }
    Scene scene = make_scene(tools::make_stadium(40000));
    const auto work = [&](AccelKind kind) {
        BuildOptions options;
        options.accel = kind;
        scene.commit(options);
        TraceStats stats;
        TraceOptions trace;
        trace.mode = Mode::kSingle;
        trace.stats = &stats;
        std::vector<Hit> hits(rays.size());
        trace_closest(scene, rays, hits, trace);
        return stats.nodes + stats.triangles;
    };
    CHECK(50 * work(AccelKind::kGridOfTrees) < work(AccelKind::kGrid));
    check_agreement(scene, rays, "teapot in a stadium");
}

TEST_CASE("trees of cells hold what is behind triangles that nothing can hit") {
    const TriangleMesh pot = tools::make_stadium(5000);
    TriangleMesh mesh = pot;
    mesh.triangles.clear();
    for (std::size_t i = 0; i < pot.triangles.size(); ++i) {
        if (i % 7 == 3) mesh.triangles.push_back({0, 0, 0});
        mesh.triangles.push_back(pot.triangles[i]);
    }
    Scene scene = make_scene(mesh);
    BuildOptions options;
    options.accel = AccelKind::kGridOfTrees;
    scene.commit(options);
    CHECK(scene.build_stats().node_count > 1000);
    std::vector<Ray> rays;
    tools::Random random(6);
    for (int i = 0; i < 500; ++i) {
        const glm::vec3 target = glm::vec3(0.0f, 0.7f, 0.0f) + random.direction();
        rays.push_back(aim(target + 5.0f * random.direction(), target));
    }
    std::vector<Hit> hits(rays.size());
    trace_closest(scene, rays, hits);
    CHECK(hits == Oracle(scene).closest(rays));
}

TEST_SUITE_BEGIN("agreement");

TEST_CASE("rays in the faces of a grid's cells, at their corners and edges, near and from afar") {
    TriangleMesh mesh;  // sheets in all planes of cells, as far as the rule cuts 8 x 8 x 8
    for (int axis = 0; axis < 3; ++axis) {
        for (int plane = 0; plane <= 8; ++plane) {
            glm::vec3 origin(0.0f), u(0.0f), v(0.0f);
            origin[axis] = static_cast<float>(plane);
            u[(axis + 1) % 3] = v[(axis + 2) % 3] = 4.0f;
            const TriangleMesh sheet = make_grid(2, 2, origin, u, v);
            const auto offset = static_cast<std::uint32_t>(mesh.positions.size());
            mesh.positions.insert(mesh.positions.end(), sheet.positions.begin(),
                                  sheet.positions.end());
            for (const glm::uvec3& t : sheet.triangles) mesh.triangles.push_back(t + offset);
        }
    }
    for (const float shift : {0.0f, 1.0f / 3.0f, 20000.0f}) {
        TriangleMesh moved = mesh;
        for (glm::vec3& p : moved.positions) p = p + shift;
        tools::Random random(31);
        std::vector<Ray> rays;
        for (int i = 0; i < 2000; ++i) {
            const auto lattice = [&] { return glm::round(16.0f * random.point()) / 2.0f + shift; };
            const glm::vec3 from = lattice(), to = lattice();
            Ray ray = aim(from, to + static_cast<float>(i % 4) * 1e-7f * random.direction());
            if (i % 5 == 0) ray.org -= 1e4f * ray.dir;
            if (i % 7 == 0) ray.org -= 1e6f * ray.dir;
            rays.push_back(ray);
        }
        check_agreement(make_scene(moved), rays, "sheets at " + std::to_string(shift));
    }
}

TEST_SUITE_END();
