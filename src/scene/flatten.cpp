#include "scene/transform.h"

#include <packet/error.h>
#include <packet/scene.h>

#include <limits>
#include <string>

namespace packet {

static void append(TriangleMesh& out, const TriangleMesh& mesh, const glm::mat4x3& matrix) {
    const std::size_t offset = out.positions.size();
    if (offset + mesh.positions.size() > std::numeric_limits<std::uint32_t>::max()) {
        throw Error(
            ErrorCode::kTooLarge,
            "the flattened scene has more than 2^32 - 1 vertices, by mesh '" + mesh.name + "'");
    }
    const bool moved = matrix != glm::mat4x3(1.0f);
    for (const glm::vec3& p : mesh.positions) {
        out.positions.push_back(moved ? transform(matrix, p) : p);
    }
    for (const glm::uvec3& t : mesh.triangles) {
        out.triangles.push_back(t + static_cast<std::uint32_t>(offset));
    }
}

TriangleMesh Scene::flatten() const {
    TriangleMesh out;
    std::size_t vertex_count = 0;
    for (const Instance& instance : instances_) {
        vertex_count += meshes_[instance.mesh_id].positions.size();
    }
    out.positions.reserve(vertex_count);
    out.triangles.reserve(triangle_count());
    for (const Instance& instance : instances_) {
        append(out, meshes_[instance.mesh_id], instance.world_from_object);
    }
    validate(out.view());
    return out;
}

}  // namespace packet
