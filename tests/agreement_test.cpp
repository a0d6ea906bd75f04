// Every structure, mode, width, instruction set and number of threads against the oracle.
#include "configurations.h"
#include "generate.h"
#include "random.h"
#include "share.h"
#include "test_rays.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace packet;
using namespace packet::test;

TEST_SUITE_BEGIN("agreement");

TEST_CASE("a small scene of every kind [baseline]") {
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        Scene scene = make_scene(kind.make(500, 3));
        const auto rays = random_rays(scene.bounds(), 1000, 17);
        check_agreement(scene, rays, std::string(kind.name));
    }
}

TEST_CASE("200 random soups") {
    for (std::uint64_t seed = 0; seed < share_of(200, 10); ++seed) {
        Scene scene = make_scene(tools::make_soup(1 + seed * 7 % 101, seed));
        const auto rays = random_rays(scene.bounds(), 4096, seed + 1000);
        check_agreement(scene, rays, "soup of seed " + std::to_string(seed));
    }
}

TEST_CASE("larger scenes of every kind") {
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        Scene scene = make_scene(kind.make(share_of(20000, 3000), 5));
        const auto rays = random_rays(scene.bounds(), 2048, 23);
        check_agreement(scene, rays, std::string(kind.name));
    }
}

TEST_CASE("tiles of rays that do not cohere") {
    // In mode tile more rays than these would go by streams.
    constexpr std::size_t kTogether = 1000;
    Scene scene = make_scene(tools::make_city(share_of(20000, 3000), 5));
    scene.commit();
    const std::vector<Ray> rays = random_rays(scene.bounds(), 4 * kTogether, 29);
    std::vector<Hit> want(rays.size()), got(rays.size());
    TraceOptions options;
    options.mode = Mode::kSingle, options.isa = IsaId::kScalar;
    trace_closest(scene, rays, want, options);
    options.mode = Mode::kTile;
    for (const IsaId isa : cpu_isas()) {
        CAPTURE(to_string(isa));
        options.isa = isa;
        TraceStats by_tiles, by_streams;
        options.stats = &by_tiles;
        for (std::size_t i = 0; i < rays.size(); i += kTogether) {
            trace_closest(scene, std::span(rays).subspan(i, kTogether),
                          std::span(got).subspan(i, kTogether), options);
        }
        CHECK(count_differences(rays, want, got) == 0);
        got.assign(rays.size(), {});
        options.stats = &by_streams;
        trace_closest(scene, rays, got, options);
        CHECK(count_differences(rays, want, got) == 0);
        CHECK(by_tiles.lane_utilization() < 1.0);
        // Those of streams are never idle, but for any-hit.
        CHECK(by_streams.lane_utilization() == 1.0);
    }
}

TEST_CASE("tiles whose rays are farther apart than triangles are large") {
    constexpr int kSide = 31;  // more rays than this square would go by streams
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        CAPTURE(kind.name);
        Scene scene = make_scene(kind.make(40000, 5));
        scene.commit();
        const Bounds3f box = scene.bounds();
        const glm::vec3 eye = box.upper + 0.5f * box.extent();
        std::vector<Ray> rays;
        for (int y = 0; y < kSide; ++y) {
            for (int x = 0; x < kSide; ++x) {
                const glm::vec3 part(static_cast<float>(x) / kSide, 0.5f,
                                     static_cast<float>(y) / kSide);
                rays.push_back(aim(eye, box.lower + part * box.extent()));
                rays.back().tfar = 4.0f;
            }
        }
        const std::vector<Hit> want = Oracle(scene).closest(rays);
        TraceOptions options;
        options.mode = Mode::kTile, options.width = kSide;
        for (const IsaId isa : cpu_isas()) {
            CAPTURE(to_string(isa));
            options.isa = isa;
            std::vector<Hit> got(rays.size());
            trace_closest(scene, rays, got, options);
            CHECK(count_differences(rays, want, got) == 0);
            std::vector<std::uint8_t> occluded(rays.size(), 7);
            trace_any(scene, rays, occluded, options);
            std::size_t different = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                different += occluded[i] != want[i].is_hit();
            }
            CHECK(different == 0);
        }
    }
}

TEST_CASE("rays at every vertex, edge and interior of a grid") {
    const glm::vec3 u(0.25f, 0.01f, 0.0f), v(-0.02f, 0.31f, 0.1f);
    TriangleMesh mesh = make_grid(12, 12, {-1.3f, -2.1f, 0.4f}, u, v);
    const auto rays = aim_at_features({0.1f, 0.3f, -3.7f}, mesh.view());
    const Oracle oracle(make_scene(mesh));
    std::size_t inner_misses = 0;
    for (std::size_t i = mesh.positions.size(); i < rays.size(); ++i) {
        inner_misses += !oracle.any(rays[i]);  // outer edges may be missed, by rounding
    }
    CHECK(inner_misses <= 24);
    check_agreement(make_scene(mesh), rays, "grid");
}

TEST_CASE("rays that start or end ever farther away, or never end") {
    Scene scene = make_scene(tools::make_sphere(1000));
    const Bounds3f box = scene.bounds();
    const float size = glm::length(box.extent());
    const glm::vec3 middle = 0.5f * (box.lower + box.upper);
    const glm::vec3 toward = glm::normalize(glm::vec3(0.3f, 0.9f, 0.21f));
    const glm::vec3 side = glm::normalize(glm::cross(toward, glm::vec3(1.0f, 0.0f, 0.0f)));
    const glm::vec3 up = glm::cross(side, toward);
    std::vector<Ray> rays;
    // Each 16 x 16 rays make a beam, whichever of its ends is the narrow one.
    for (const float far : {0.5f, 3.0f, 10.0f, 1e2f, 1e3f, 1e4f, 1e6f, 1e10f, 1e20f, 1e29f}) {
        for (int i = 0; i < 4 * 256; ++i) {
            const float x = static_cast<float>(i % 16) / 16.0f - 0.5f;
            const float y = static_cast<float>(i / 16 % 16) / 16.0f - 0.5f;
            // So near each other that they are taken for coherent, and go by tiles if asked to.
            const std::size_t block = rays.size() / 256;
            const auto angle = static_cast<float>(block);
            const glm::vec3 centre = 0.2f * (std::cos(angle) * side + std::sin(angle) * up);
            const glm::vec3 place = middle + size * (centre + 0.1f * (x * side + y * up));
            Ray ray;
            switch (i / 256) {
                case 0:  // parallel, as to a sun
                    ray.org = place, ray.dir = toward, ray.tfar = far;
                    break;
                case 1:  // to a light
                    ray = aim(place, middle + far * size * toward), ray.tfar = 0.999f;
                    break;
                case 2:  // from an eye
                    ray = aim(middle - far * size * toward, place);
                    break;
                default:  // through a point behind all
                    ray.org = place, ray.dir = toward + 0.02f * (x * side + y * up);
                    ray.tfar = far;
            }
            rays.push_back(ray);
        }
    }
    check_agreement(scene, rays, "far ends");
}

TEST_CASE("the first rays of a stream can hit nothing") {
    Scene scene = make_scene(tools::make_sphere(1000));
    const Bounds3f box = scene.bounds();
    const glm::vec3 eye = box.upper + glm::vec3(5.0f, 1.0f, 1.5f) * box.extent();
    std::vector<Ray> rays;
    for (int i = 0; i < 64; ++i) {
        const int column = i % 8, row = i / 8;
        const glm::vec3 place(0.5f, 0.3f + 0.05f * static_cast<float>(column),
                              0.3f + 0.05f * static_cast<float>(row));
        rays.push_back(aim(eye, box.lower + place * box.extent()));
        if (i < 16) rays.back().tfar = -1.0f;
    }
    check_agreement(scene, rays, "the first 16 of 64");
}

TEST_CASE("rays in the planes of boxes, along axes, and starting on them") {
    TriangleMesh mesh = make_grid(8, 8, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    const TriangleMesh wall = make_grid(8, 8, {0, 0, 0}, {0, 1, 0}, {0, 0, 1});
    const auto offset = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), wall.positions.begin(), wall.positions.end());
    for (const glm::uvec3& t : wall.triangles) mesh.triangles.push_back(t + offset);
    std::vector<Ray> rays;
    for (int axis = 0; axis < 3; ++axis) {
        for (float x = -1.0f; x <= 9.0f; x += 0.5f) {
            for (float y = -1.0f; y <= 9.0f; y += 0.5f) {
                for (const float start : {-2.0f, 0.0f, 8.0f, 10.0f}) {
                    Ray ray;
                    ray.org[axis] = start;
                    ray.org[(axis + 1) % 3] = x;
                    ray.org[(axis + 2) % 3] = y;
                    ray.dir = glm::vec3(0.0f);
                    ray.dir[axis] = start > 4.0f ? -1.0f : 1.0f;
                    rays.push_back(ray);
                    ray.dir[(axis + 1) % 3] = -0.0f;
                    ray.dir[(axis + 2) % 3] = 1e-30f;
                    rays.push_back(ray);
                }
            }
        }
    }
    check_agreement(make_scene(std::move(mesh)), rays, "planes");
}

TEST_CASE("rays that start next to surfaces, or just where they hit them") {
    // On either side of walls, by up to what boxes are grown by, and any way, as shadows' rays do.
    for (int axis = 0; axis < 3; ++axis) {
        glm::vec3 origin(-7.3f, 3.1f, 5.9f), u(0.0f), v(0.0f), normal(0.0f);
        u[(axis + 1) % 3] = 1.13f, v[(axis + 2) % 3] = 0.87f, normal[axis] = 1.0f;
        const Scene scene = make_scene(make_grid(12, 12, origin, u, v));
        const Oracle oracle(scene);
        tools::Random random(31);
        std::vector<Ray> rays;
        for (int i = 0; i < 2048; ++i) {
            const float across = random.uniform(0.0f, 12.0f), up = random.uniform(0.0f, 12.0f);
            const float ulps = random.uniform(-3.0f, 3.0f) * static_cast<float>(1 << i % 4);
            Ray ray;
            ray.org = origin + across * u + up * v + ulps * 0x1p-21f * normal;
            ray.dir = random.direction();
            if (i % 2 == 1) ray.org -= random.uniform() * ray.dir;
            if (i % 8 < 2) ray.dir[axis] *= 1e-3f;
            if (i % 5 == 1) ray.tfar = 0.1f;
            const Hit hit = oracle.closest(ray);
            if (i % 4 == 3 && hit.is_hit()) ray.tnear = hit.t;
            rays.push_back(ray);
        }
        check_agreement(scene, rays, "next to a wall");
    }
}

TEST_CASE("directions so short that products with their reciprocals overflow") {
    TriangleMesh mesh = tools::make_sphere(1000);
    for (glm::vec3& p : mesh.positions) p = 100.0f * p + 1e6f;
    const Scene scene = make_scene(mesh);
    std::vector<Ray> rays = random_rays(scene.bounds(), 2048, 37);
    for (Ray& ray : rays) {
        ray.dir *= 0x1p-115f / glm::length(ray.dir);  // t is far below the largest float
        ray.tnear = 1e30f, ray.tfar = std::numeric_limits<float>::infinity();
    }
    const Oracle oracle(scene);
    CHECK(std::ranges::count_if(rays, [&](const Ray& ray) { return oracle.any(ray); }) > 500);
    check_agreement(scene, rays, "short directions");
}

TEST_CASE("slivers") {
    tools::Random random(77);
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < 300; ++i) {
        const glm::vec3 p = random.point(), along = random.direction();
        mesh.positions.insert(mesh.positions.end(),
                              {p, p + along, p + 0.5f * along + 1e-6f * random.direction()});
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    Scene scene = make_scene(mesh);
    auto rays = random_rays(scene.bounds(), 2048, 5);
    const auto aimed = aim_at_features({0.4f, 0.5f, -2.0f}, mesh.view());
    rays.insert(rays.end(), aimed.begin(), aimed.end());
    check_agreement(scene, rays, "slivers");
}

TEST_CASE("nested spheres and equal triangles: ties go to the smallest prim_id") {
    TriangleMesh mesh;
    for (const float radius : {1.0f, 0.5f, 0.5f, 0.25f, 1.0f}) {
        const TriangleMesh sphere = tools::make_sphere(128);
        const auto offset = static_cast<std::uint32_t>(mesh.positions.size());
        for (const glm::vec3& p : sphere.positions) mesh.positions.push_back(radius * p);
        for (const glm::uvec3& t : sphere.triangles) mesh.triangles.push_back(t + offset);
    }
    auto rays = aim_at_features({0.0f, 0.0f, 0.0f}, mesh.view());
    for (const Ray& ray : aim_at_features({3.0f, 0.1f, 0.2f}, mesh.view())) rays.push_back(ray);
    check_agreement(make_scene(std::move(mesh)), rays, "nested spheres");
}

TEST_CASE("hundreds of identical triangles") {
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles.assign(700, {0, 1, 2});
    Scene scene = make_scene(mesh);
    Bounds3f box = scene.bounds();
    box.extend(glm::vec3(0, 0, 1));
    check_agreement(scene, random_rays(box, 1024, 9), "identical triangles");
}

TEST_CASE("sizes from 1e-15 to 1e15, near and far from the origin") {
    for (const float scale : {1e-15f, 1e-9f, 1e-3f, 1e3f, 1e9f, 1e15f}) {
        for (const float shift : {0.0f, 1.0f, 300.0f}) {
            TriangleMesh mesh = tools::make_sphere(200);
            for (glm::vec3& p : mesh.positions) p = scale * (p + shift * glm::vec3(1, -0.7f, 0.3f));
            Scene scene = make_scene(mesh);
            check_agreement(scene, random_rays(scene.bounds(), 512, 31),
                            "scale " + std::to_string(scale) + " shift " + std::to_string(shift));
        }
    }
}

TEST_CASE("numbers beyond the exact range neither crash nor yield NaN") {
    for (const float scale : {1e-42f, 1e-30f, 1e-20f, 1e17f, 1.5e18f}) {
        TriangleMesh mesh = tools::make_sphere(200);
        for (glm::vec3& p : mesh.positions) p *= scale;
        Scene scene = make_scene(mesh);
        auto rays = random_rays(scene.bounds(), 512, 37);
        for (std::size_t i = 0; i < rays.size(); i += 5) rays[i].org *= 1e15f;
        for (std::size_t i = 1; i < rays.size(); i += 5) rays[i].dir *= 1e37f;
        for (std::size_t i = 2; i < rays.size(); i += 5) rays[i].dir *= 1e-37f;
        for (const Hit& hit : Oracle(scene).closest(rays)) {
            REQUIRE(!std::isnan(hit.t + hit.u + hit.v));
        }
        check_agreement(scene, rays, "scale " + std::to_string(scale));
    }
}

TEST_CASE("rays that are no rays hit nothing") {
    const float nan = std::nanf(""), inf = INFINITY;
    Scene scene = make_scene(tools::make_sphere(500));
    std::vector<Ray> rays;
    for (int component = 0; component < 8; ++component) {
        for (const float bad : {nan, inf, -inf}) {
            Ray ray = aim({0.1f, 0.2f, 0.3f}, {0.5f, 0.7f, -0.3f});
            float* const parts[8] = {&ray.org.x, &ray.org.y, &ray.org.z, &ray.tnear,
                                     &ray.dir.x, &ray.dir.y, &ray.dir.z, &ray.tfar};
            *parts[component] = bad;
            rays.push_back(ray);
            const bool is_tnear = component == 3 && bad == -inf,
                       is_tfar = component == 7 && bad == inf;
            CHECK(Oracle(scene).any(ray) == (is_tnear || is_tfar));
        }
    }
    rays.push_back(aim({0, 0, 0}, {0, 0, 0}));
    rays.push_back(aim({0, 0, 0}, {0, 0, 1e-40f}));
    rays.back().tfar = inf;
    rays.push_back(aim({0, 0, 0}, {0, 0, 1}));
    rays.back().tnear = 2.0f, rays.back().tfar = 1.5f;
    for (std::size_t i = rays.size() - 3; i < rays.size(); ++i) CHECK(!Oracle(scene).any(rays[i]));
    check_agreement(scene, rays, "no rays");
}

TEST_CASE("the segment is closed at both ends") {
    TriangleMesh mesh = make_grid(1, 1, {-1, -1, 2}, {2, 0, 0}, {0, 2, 0});
    std::vector<Ray> rays;
    const float below = std::nextafter(2.0f, 0.0f), above = std::nextafter(2.0f, 3.0f);
    const float ends[][2] = {{0, 2}, {2, 2}, {2, 3}, {0, below}, {above, 3}, {-5, 2}};
    for (const auto& [tnear, tfar] : ends) {
        Ray ray = aim({0.3f, 0.2f, 0}, {0.3f, 0.2f, 1});
        ray.tnear = tnear, ray.tfar = tfar;
        rays.push_back(ray);
    }
    const Oracle oracle(make_scene(mesh));
    const bool want[] = {true, true, true, false, false, true};
    for (std::size_t i = 0; i < rays.size(); ++i) CHECK(oracle.any(rays[i]) == want[i]);
    check_agreement(make_scene(std::move(mesh)), rays, "ends");
}

TEST_CASE("instances under any affine transform") {
    tools::Random random(4);
    Scene scene;
    scene.add_mesh(tools::make_sphere(72));
    scene.add_mesh(tools::make_soup(60, 2));
    scene.add_mesh(tools::make_city(200, 2));
    for (std::uint32_t i = 0; i < 60; ++i) {
        glm::mat4x3 m;
        for (int column = 0; column < 3; ++column) m[column] = random.direction();
        m[3] = 10.0f * random.point();
        if (i % 4 == 0) m[0] = -m[0];
        if (i % 5 == 0) m[1] *= 0.01f;
        scene.add_instance(i % 3, m);
    }
    check_agreement(scene, random_rays(scene.bounds(), 4096, 12), "instances");
}

TEST_CASE("coinciding instances: ties go to the smallest instance_id") {
    Scene scene;
    const auto mesh = scene.add_mesh(tools::make_sphere(72));
    for (int i = 0; i < 5; ++i) scene.add_instance(mesh, glm::mat4x3(2.0f));
    check_agreement(scene, random_rays(scene.bounds(), 1024, 12), "coinciding instances");
    scene.commit();
    CHECK(trace_closest(scene, aim({0, 0, 0}, {0.3f, 0.2f, 0.9f})).instance_id == 0);
}

TEST_SUITE_END();
