#include "oracle.h"

#include "scene/transform.h"
#include "scene/triangle_fault.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

namespace packet::test {

namespace {

struct Slab {
    float enter, exit;
};

/// A ray in the space of one mesh with what the contract derives from it.
struct MeshRay {
    glm::vec3 org, dir, inv, growth;
    float tnear, tfar;
    int kx, ky, kz;
    float sx, sy, sz;
};

bool is_usable(const Ray& ray) {
    float longest = 0.0f;
    for (int a = 0; a < 3; ++a) {
        if (!std::isfinite(ray.org[a]) || !std::isfinite(ray.dir[a])) return false;
        longest = std::max(longest, std::fabs(ray.dir[a]));
    }
    return longest >= FLT_MIN && ray.tnear <= ray.tfar;
}

MeshRay prepare(const Ray& ray, const Bounds3f& bounds) {
    MeshRay r{};
    r.org = ray.org, r.dir = ray.dir;
    r.tnear = std::max(ray.tnear, -FLT_MAX), r.tfar = std::min(ray.tfar, FLT_MAX);
    float reach = 0.0f;
    for (int a = 0; a < 3; ++a) {
        reach = std::max(reach, std::fabs(bounds.lower[a] - ray.org[a]));
        reach = std::max(reach, std::fabs(bounds.upper[a] - ray.org[a]));
        r.inv[a] = std::clamp(1.0f / ray.dir[a], -FLT_MAX, FLT_MAX);
    }
    for (int a = 0; a < 3; ++a) {
        r.growth[a] = reach * std::ldexp(8.0f, -24) + std::fabs(r.org[a]) * std::ldexp(2.0f, -24);
    }
    const glm::vec3 size(std::fabs(r.dir.x), std::fabs(r.dir.y), std::fabs(r.dir.z));
    r.kz = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    r.kx = (r.kz + 1) % 3, r.ky = (r.kz + 2) % 3;
    r.sx = r.dir[r.kx] / r.dir[r.kz];
    r.sy = r.dir[r.ky] / r.dir[r.kz];
    r.sz = 1.0f / r.dir[r.kz];
    return r;
}

Slab meet_box(const MeshRay& r, const glm::vec3& lower, const glm::vec3& upper) {
    Slab out{-INFINITY, INFINITY};
    for (int a = 0; a < 3; ++a) {
        const float t0 = (lower[a] - (r.org[a] + r.growth[a])) * r.inv[a];
        const float t1 = (upper[a] - (r.org[a] - r.growth[a])) * r.inv[a];
        out.enter = std::max(out.enter, std::min(t0, t1));
        out.exit = std::min(out.exit, std::max(t0, t1));
    }
    return out;
}

float edge(float ax, float by, float ay, float bx) { return ax * by - ay * bx; }

float exact_edge(float ax, float by, float ay, float bx) {
    const double exact = static_cast<double>(ax) * static_cast<double>(by) -
                         static_cast<double>(ay) * static_cast<double>(bx);
    const float rounded = static_cast<float>(exact);
    if (rounded == 0.0f && exact != 0.0) return exact > 0.0 ? FLT_TRUE_MIN : -FLT_TRUE_MIN;
    return rounded;
}

/// Where the ray meets the triangle's plane, and the last two barycentric coordinates.
struct Meeting {
    float t, u, v;
};

Meeting meet_in_double(const float (&x)[3], const float (&y)[3], const float (&depth)[3],
                       float sz) {
    const auto edge = [&](int a, int b) {
        return static_cast<double>(x[a]) * static_cast<double>(y[b]) -
               static_cast<double>(y[a]) * static_cast<double>(x[b]);
    };
    const double u = edge(2, 1), v = edge(0, 2), w = edge(1, 0), det = u + v + w;
    const double t = u / det * static_cast<double>(depth[0]) +
                     v / det * static_cast<double>(depth[1]) +
                     w / det * static_cast<double>(depth[2]);
    return {static_cast<float>(t * static_cast<double>(sz)), static_cast<float>(v / det),
            static_cast<float>(w / det)};
}

float largest(const float (&a)[3]) {
    return std::max({std::fabs(a[0]), std::fabs(a[1]), std::fabs(a[2])});
}

/// A hit with prim_id 0, or a miss.
Hit meet_triangle(const MeshRay& r, const glm::vec3 (&corner)[3]) {
    float x[3], y[3], z[3], depth[3];
    for (int i = 0; i < 3; ++i) {
        const glm::vec3 p = corner[i] - r.org;
        x[i] = p[r.kx] - r.sx * p[r.kz];
        y[i] = p[r.ky] - r.sy * p[r.kz];
        depth[i] = p[r.kz];
        z[i] = r.sz * depth[i];
    }
    float u = edge(x[2], y[1], y[2], x[1]);
    float v = edge(x[0], y[2], y[0], x[2]);
    float w = edge(x[1], y[0], y[1], x[0]);
    if (u == 0.0f || v == 0.0f || w == 0.0f) {
        u = exact_edge(x[2], y[1], y[2], x[1]);
        v = exact_edge(x[0], y[2], y[0], x[2]);
        w = exact_edge(x[1], y[0], y[1], x[0]);
    }
    const bool inside = (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
    const float det = u + v + w;
    if (!inside || det == 0.0f) return {};

    glm::vec3 lower, upper;
    for (int a = 0; a < 3; ++a) {
        lower[a] = std::min({corner[0][a], corner[1][a], corner[2][a]});
        upper[a] = std::max({corner[0][a], corner[1][a], corner[2][a]});
    }
    const Slab box = meet_box(r, lower, upper);
    Meeting m{u / det * z[0] + v / det * z[1] + w / det * z[2], v / det, w / det};
    if (2.0f * std::fabs(det) < largest(x) * largest(y)) m = meet_in_double(x, y, depth, r.sz);
    float t = m.t;
    if (std::isnan(t) || box.enter > box.exit) return {};
    t = std::min(std::max(t, box.enter), box.exit);
    if (!(r.tnear <= t && t <= r.tfar)) return {};
    // + 0 makes -0 a 0: a hit has one representation
    return {t + 0.0f, m.u + 0.0f, m.v + 0.0f, 0, 0, 0};
}

}  // namespace

Oracle::Oracle(const Scene& scene) {
    for (const TriangleMesh& source : scene.meshes()) {
        Mesh mesh;
        for (std::size_t i = 0; i < source.triangles.size(); ++i) {
            const glm::uvec3 t = source.triangles[i];
            const Triangle triangle{
                {source.positions[t.x], source.positions[t.y], source.positions[t.z]},
                static_cast<std::uint32_t>(i)};
            const auto& v = triangle.v;
            if (find_fault(v[0], v[1], v[2]) != TriangleFault::kNone) continue;
            for (const glm::vec3& p : v) mesh.bounds.extend(p);
            mesh.triangles.push_back(triangle);
        }
        meshes_.push_back(std::move(mesh));
    }
    for (const Instance& source : scene.instances()) {
        const ObjectFromWorld inverse = invert(source.world_from_object, "oracle's instance");
        Placed placed{{}, source.mesh_id};
        std::copy_n(&inverse.row[0][0], 12, &placed.object_from_world[0][0]);
        instances_.push_back(placed);
    }
}

Hit Oracle::closest(const Ray& ray) const {
    Hit best;
    if (!is_usable(ray)) return best;
    for (std::uint32_t id = 0; id < instances_.size(); ++id) {
        const auto& m = instances_[id].object_from_world;
        Ray moved = ray;
        for (int row = 0; row < 3; ++row) {
            moved.org[row] =
                m[row][0] * ray.org.x + m[row][1] * ray.org.y + m[row][2] * ray.org.z + m[row][3];
            moved.dir[row] = m[row][0] * ray.dir.x + m[row][1] * ray.dir.y + m[row][2] * ray.dir.z;
        }
        if (!is_usable(moved)) continue;
        const Mesh& mesh = meshes_[instances_[id].mesh_id];
        const MeshRay prepared = prepare(moved, mesh.bounds);
        for (const Triangle& triangle : mesh.triangles) {
            Hit hit = meet_triangle(prepared, triangle.v);
            if (!hit.is_hit()) continue;
            hit.prim_id = triangle.prim_id;
            hit.mesh_id = instances_[id].mesh_id;
            hit.instance_id = id;
            // Triangles come in the order of the tie rule, so at equal t the first one stays.
            if (!best.is_hit() || hit.t < best.t) best = hit;
        }
    }
    return best;
}

std::vector<Hit> Oracle::closest(std::span<const Ray> rays) const {
    std::vector<Hit> hits(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = closest(rays[i]);
    return hits;
}

}  // namespace packet::test
