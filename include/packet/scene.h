// A scene: meshes, instances of them, and the structures that make them fast to trace.
#pragma once

#include <packet/accel.h>
#include <packet/bounds.h>
#include <packet/mesh.h>

#include <glm/mat4x3.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace packet {

struct SceneAccel;

/// A mesh placed in the world. `world_from_object` is any affine transform that can be inverted.
struct Instance {
    std::uint32_t mesh_id = 0;
    glm::mat4x3 world_from_object{1.0f};
};

/// Meshes and instances. Fill it, commit() it, trace it; change it and commit() again. Tracing one
/// committed scene from many threads is safe; changing it meanwhile is not. Copies share
/// structures.
class Scene {
public:
    /// Adds a mesh and returns its `mesh_id`. It is seen only through instances.
    /// Throws Error{kBadIndex} or Error{kTooLarge} as validate() does; the scene is then unchanged.
    std::uint32_t add_mesh(TriangleMesh mesh);

    /// Places a mesh and returns the `instance_id`. Throws Error{kBadIndex} for an unknown mesh and
    /// Error{kBadValue} for a transform that is not finite or cannot be inverted.
    std::uint32_t add_instance(std::uint32_t mesh_id,
                               const glm::mat4x3& world_from_object = glm::mat4x3(1.0f));

    /// Builds what tracing needs. On an Error, or what options.progress throws, the scene stays as
    /// it was, an earlier commit included, and nothing is left of the build. Memory that builds
    /// and traces give back, up to 512 MB of it, stays reserved for the next ones; the system may
    /// take all but 32 MB meanwhile (MADV_FREE).
    void commit(const BuildOptions& options = {});

    [[nodiscard]] std::span<const TriangleMesh> meshes() const noexcept { return meshes_; }
    [[nodiscard]] std::span<const Instance> instances() const noexcept { return instances_; }
    /// Triangles in the world: a mesh counts once for each of its instances.
    [[nodiscard]] std::size_t triangle_count() const noexcept;
    /// The box of all instances' finite vertices in the world. O(vertices of the instances).
    [[nodiscard]] Bounds3f bounds() const noexcept;
    /// Triangles that can never be hit, summed over the instances. O(triangles of the instances).
    [[nodiscard]] SkippedTriangles skipped() const;

    /// All instances baked into one mesh in order, so that `prim_id` is the global triangle number.
    [[nodiscard]] TriangleMesh flatten() const;

    [[nodiscard]] bool committed() const noexcept { return accel_ != nullptr; }
    /// Sums over all meshes of the last commit; depth is the greatest, the SAH cost that of the
    /// mesh with most triangles. Throws Error{kNotCommitted}.
    [[nodiscard]] const BuildStats& build_stats() const;

    /// For the library's own layers. Throws Error{kNotCommitted}.
    [[nodiscard]] const SceneAccel& accel() const;

private:
    std::vector<TriangleMesh> meshes_;
    std::vector<Instance> instances_;
    std::shared_ptr<const SceneAccel> accel_;
};

/// A scene of one mesh and one instance that leaves it where it is.
[[nodiscard]] Scene make_scene(TriangleMesh mesh);

}  // namespace packet
