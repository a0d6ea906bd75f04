// Rays for tests, from kind to mean.
#pragma once

#include "random.h"

#include <packet/packet.h>

#include <vector>

namespace packet::test {

/// Random rays in and about the box; a third of them short, a few starting late, some along axes.
[[nodiscard]] inline std::vector<Ray> random_rays(const Bounds3f& box, std::size_t count,
                                                  std::uint64_t seed) {
    tools::Random random(seed);
    const float size = glm::length(box.extent());
    std::vector<Ray> rays(count);
    for (std::size_t i = 0; i < count; ++i) {
        Ray& ray = rays[i];
        ray.org = box.lower + (1.4f * random.point() - 0.2f) * box.extent();
        ray.dir = random.direction() * random.uniform(0.1f, 10.0f);
        if (i % 3 == 0) ray.tfar = size * random.uniform();
        if (i % 7 == 0) ray.tnear = 0.1f * size * random.uniform();
        if (i % 11 == 0) ray.dir[static_cast<int>(i) % 3] = i % 2 == 0 ? 0.0f : -0.0f;
        if (i % 13 == 0) {
            const float sign = i % 2 == 0 ? 1.0f : -1.0f;
            ray.dir = glm::vec3(0.0f);
            ray.dir[static_cast<int>(i / 13) % 3] = sign;
        }
    }
    return rays;
}

/// From `eye` exactly towards `target`, which lies at t = 1 as far as float can say.
[[nodiscard]] inline Ray aim(const glm::vec3& eye, const glm::vec3& target) {
    Ray ray;
    ray.org = eye;
    ray.dir = target - eye;
    return ray;
}

/// From `eye` at every vertex, at the middle of every edge and of every triangle.
[[nodiscard]] inline std::vector<Ray> aim_at_features(const glm::vec3& eye, MeshView mesh) {
    std::vector<Ray> rays;
    for (const glm::vec3& p : mesh.positions) rays.push_back(aim(eye, p));
    for (const glm::uvec3& t : mesh.triangles) {
        const glm::vec3 &a = mesh.positions[t.x], &b = mesh.positions[t.y],
                        &c = mesh.positions[t.z];
        for (const glm::vec3& target :
             {0.5f * a + 0.5f * b, 0.5f * b + 0.5f * c, 0.5f * c + 0.5f * a, (a + b + c) / 3.0f}) {
            rays.push_back(aim(eye, target));
        }
    }
    return rays;
}

/// nx x ny cells of two triangles in the plane spanned by u and v at `origin`; vertices are shared.
[[nodiscard]] inline TriangleMesh make_grid(int nx, int ny, const glm::vec3& origin,
                                            const glm::vec3& u, const glm::vec3& v) {
    TriangleMesh mesh;
    for (int y = 0; y <= ny; ++y) {
        for (int x = 0; x <= nx; ++x) {
            mesh.positions.push_back(origin + static_cast<float>(x) * u +
                                     static_cast<float>(y) * v);
        }
    }
    const auto id = [nx](int x, int y) { return static_cast<std::uint32_t>(y * (nx + 1) + x); };
    for (int y = 0; y < ny; ++y) {
        for (int x = 0; x < nx; ++x) {
            mesh.triangles.push_back({id(x, y), id(x + 1, y), id(x + 1, y + 1)});
            mesh.triangles.push_back({id(x, y), id(x + 1, y + 1), id(x, y + 1)});
        }
    }
    return mesh;
}

}  // namespace packet::test
