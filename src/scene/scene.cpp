#include "scene/scene_accel.h"
#include "scene/transform.h"
#include "scene/triangle_fault.h"

#include <packet/error.h>
#include <packet/scene.h>

#include <cmath>
#include <string>
#include <utility>

namespace packet {

std::uint32_t Scene::add_mesh(TriangleMesh mesh) {
    validate(mesh.view());
    meshes_.push_back(std::move(mesh));
    return static_cast<std::uint32_t>(meshes_.size() - 1);
}

std::uint32_t Scene::add_instance(std::uint32_t mesh_id, const glm::mat4x3& world_from_object) {
    const std::string what = "transform of instance " + std::to_string(instances_.size());
    if (mesh_id >= meshes_.size()) {
        throw Error(ErrorCode::kBadIndex, "instance " + std::to_string(instances_.size()) +
                                              " refers to mesh " + std::to_string(mesh_id) +
                                              " of " + std::to_string(meshes_.size()));
    }
    (void)invert(world_from_object, what.c_str());  // throws if there is none
    instances_.push_back({mesh_id, world_from_object});
    return static_cast<std::uint32_t>(instances_.size() - 1);
}

void Scene::commit(const BuildOptions& options) {
    accel_ = build_scene_accel(meshes_, instances_, options);
}

std::size_t Scene::triangle_count() const noexcept {
    std::size_t count = 0;
    for (const Instance& instance : instances_) count += meshes_[instance.mesh_id].triangles.size();
    return count;
}

Bounds3f Scene::bounds() const noexcept {
    Bounds3f box;
    for (const Instance& instance : instances_) {
        const TriangleMesh& mesh = meshes_[instance.mesh_id];
        for (const glm::uvec3& triangle : mesh.triangles) {
            for (int corner = 0; corner < 3; ++corner) {
                const glm::vec3 p =
                    transform(instance.world_from_object, mesh.positions[triangle[corner]]);
                if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) box.extend(p);
            }
        }
    }
    return box;
}

SkippedTriangles Scene::skipped() const {
    SkippedTriangles skipped;
    for (const Instance& instance : instances_) {
        const TriangleMesh& mesh = meshes_[instance.mesh_id];
        for (const glm::uvec3& t : mesh.triangles) {
            add_fault(skipped,
                      find_fault(mesh.positions[t.x], mesh.positions[t.y], mesh.positions[t.z]));
        }
    }
    return skipped;
}

static const SceneAccel& require_committed(const std::shared_ptr<const SceneAccel>& accel) {
    if (accel == nullptr) {
        throw Error(ErrorCode::kNotCommitted, "the scene has not been committed: call commit()");
    }
    return *accel;
}

const BuildStats& Scene::build_stats() const { return require_committed(accel_).stats; }
const SceneAccel& Scene::accel() const { return require_committed(accel_); }

Scene make_scene(TriangleMesh mesh) {
    Scene scene;
    scene.add_instance(scene.add_mesh(std::move(mesh)));
    return scene;
}

}  // namespace packet
