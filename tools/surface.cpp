// The surface where a ray hits it, and the rays that go on from there.
#include "surface.h"

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>

namespace packet::tools {

Surface surface_at(const Scene& scene, const Ray& ray, const Hit& hit) {
    const TriangleMesh& mesh = scene.meshes()[hit.mesh_id];
    const glm::mat4x3& world_from_object = scene.instances()[hit.instance_id].world_from_object;
    const glm::uvec3& triangle = mesh.triangles[hit.prim_id];
    glm::dvec3 v[3];  // in doubles, as the product of a tiny triangle's edges is no float
    double magnitude = 0.0;
    for (int i = 0; i < 3; ++i) {
        v[i] = world_from_object * glm::vec4(mesh.positions[triangle[i]], 1.0f);
        for (int axis = 0; axis < 3; ++axis) magnitude = std::max(magnitude, std::abs(v[i][axis]));
    }
    const glm::dvec3 edge1 = v[1] - v[0], edge2 = v[2] - v[0];
    glm::dvec3 normal = glm::normalize(glm::cross(edge1, edge2));
    if (glm::dot(normal, glm::dvec3(ray.dir)) > 0.0) normal = -normal;

    // 16 units in the last place of the triangle's coordinates: the hit and the ray round by a few.
    const double offset = 0x1p-20 * magnitude;
    const glm::dvec3 point = v[0] + double{hit.u} * edge1 + double{hit.v} * edge2;
    return {glm::vec3(point + offset * normal), glm::vec3(normal)};
}

Ray scatter(const Surface& surface, float tfar, Random& random) {
    return {surface.origin, 0.0f, random.cosine_direction(surface.normal), tfar};
}

float diagonal(const Bounds3f& bounds) { return glm::length(bounds.extent()); }

}  // namespace packet::tools
