// No ray slips between triangles that share vertices, however far from the origin they lie.
#include "configurations.h"
#include "generate.h"
#include "share.h"
#include "test_rays.h"

#include <doctest/doctest.h>
#include <glm/vec4.hpp>

using namespace packet;
using namespace packet::test;

namespace {

std::size_t count_leaks(const Scene& scene, std::span<const Ray> rays, Mode mode) {
    TraceOptions options;
    options.mode = mode;
    std::vector<Hit> hits(rays.size());
    trace_closest(scene, rays, hits, options);
    std::vector<std::uint8_t> occluded(rays.size());
    trace_any(scene, rays, occluded, options);
    std::size_t leaks = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) leaks += !hits[i].is_hit() || occluded[i] == 0;
    return leaks;
}

void check_no_leaks(const Scene& scene, std::span<const Ray> rays) {
    for (const ModeName& mode : mode_names()) {
        CAPTURE(mode.name);
        CHECK(count_leaks(scene, rays, mode.mode) == 0);
    }
}

/// Rays whose line stays within the outer edges, as targets there are missed or met by rounding.
std::vector<Ray> aim_inside(const glm::vec3& eye, const TriangleMesh& grid, int nx, int ny) {
    std::vector<Ray> rays;
    for (int y = 1; y < ny; ++y) {
        for (int x = 1; x < nx; ++x) {
            const auto at = [&](int i, int j) {
                return grid.positions[static_cast<std::size_t>(j * (nx + 1) + i)];
            };
            const glm::vec3 p = at(x, y);
            rays.push_back(aim(eye, p));
            for (const glm::vec3& q : {at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)}) {
                rays.push_back(aim(eye, 0.5f * p + 0.5f * q));
                rays.push_back(aim(eye, 0.75f * p + 0.25f * q));
            }
        }
    }
    return rays;
}

}  // namespace

TEST_CASE("a 12 x 12 plane far from the origin holds rays at vertices, edges and interiors") {
    const glm::vec3 far(148376.0f, 1234.0f, -223423.0f);
    const glm::vec3 u(1.0f, 0.0f, 0.25f), v(0.125f, 1.0f, 0.0f);
    TriangleMesh mesh = make_grid(12, 12, far - 6.0f * u - 6.0f * v, u, v);
    Scene scene = make_scene(mesh);
    scene.commit();
    for (const glm::vec3& eye :
         {glm::vec3(0, 0, 20), glm::vec3(0, 0, -0.5f), glm::vec3(3, 2, 900)}) {
        check_no_leaks(scene, aim_inside(far + eye, mesh, 12, 12));
    }
}

TEST_CASE("a closed sphere far from the origin holds rays aimed from inside at all its features") {
    const glm::vec3 far(148376.0f, 1234.0f, -223423.0f);
    TriangleMesh mesh = tools::make_sphere(8 * 20 * 20);
    for (glm::vec3& p : mesh.positions) p = far + 10.0f * p;
    Scene scene = make_scene(mesh);
    scene.commit();
    check_no_leaks(scene, aim_at_features(far + glm::vec3(1.0f, -2.0f, 0.5f), mesh.view()));
}

TEST_CASE("an instance holds rays from inside at all features, whatever its transform") {
    tools::Random random(8);
    const TriangleMesh mesh = tools::make_sphere(8 * 8 * 8);
    const auto features = aim_at_features({0.1f, -0.2f, 0.05f}, mesh.view());
    Scene scene;
    scene.add_mesh(mesh);
    std::vector<Ray> rays;
    while (scene.instances().size() < share_of(30, 3)) {
        const std::size_t i = scene.instances().size();
        glm::mat4x3 m;
        for (int column = 0; column < 3; ++column) m[column] = random.direction();
        if (std::abs(glm::dot(m[0], glm::cross(m[1], m[2]))) < 0.1f) continue;
        if (i % 2 == 0) m[0] = -m[0];
        if (i % 3 == 0) m[1] *= 0.01f;
        m[3] = 1000.0f * random.point();
        scene.add_instance(0, m);
        for (const Ray& ray : features) {
            rays.push_back({m * glm::vec4(ray.org, 1.0f), 0.0f, m * glm::vec4(ray.dir, 0.0f)});
        }
    }
    for (const Build& build : all_builds()) {
        CAPTURE(build.name);
        scene.commit(build.options);
        check_no_leaks(scene, rays);
        // What leaves its own sphere might hit another.
        std::vector<Hit> hits(rays.size());
        trace_closest(scene, rays, hits);
        std::size_t strays = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            strays += hits[i].instance_id != i / features.size();
        }
        CHECK(strays == 0);
    }
}

TEST_CASE("a million rays from inside spheres of all sizes, off the origin, all hit") {
    tools::Random random(2024);
    constexpr std::size_t kSpheres = 250, kRaysEach = 4000;
    for (std::size_t i = 0; i < share_of(kSpheres); ++i) {
        CAPTURE(i);
        const float radius = std::pow(10.0f, random.uniform(-3.0f, 3.0f));
        const glm::vec3 center = radius * 500.0f * (2.0f * random.point() - 1.0f);
        TriangleMesh mesh = tools::make_sphere(8 * 12 * 12);
        for (glm::vec3& p : mesh.positions) p = center + radius * p;
        Scene scene = make_scene(mesh);
        scene.commit();
        std::vector<Ray> rays;
        while (rays.size() < kRaysEach) {
            const glm::vec3 eye = center + 0.5f * radius * random.direction();
            const auto& t = mesh.triangles[random.next() % mesh.triangles.size()];
            const glm::vec3 &a = mesh.positions[t.x], &b = mesh.positions[t.y];
            const float s = random.uniform();
            rays.push_back(aim(eye, a));
            rays.push_back(aim(eye, a + s * (b - a)));
            rays.push_back({eye, 0.0f, random.direction()});
        }
        REQUIRE(count_leaks(scene, rays, Mode::kSingle) == 0);
        REQUIRE(count_leaks(scene, rays, Mode::kPacket16) == 0);
    }
}
