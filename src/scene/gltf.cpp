// Makes a scene of a glTF file: its meshes that are placed and have triangles, in the file's order,
// and an instance for each node that places one, depth first.
#include <packet/gltf.h>

#include "scene/gltf_document.h"
#include "scene/gltf_load.h"
#include "scene/gltf_mesh.h"
#include "scene/gltf_nodes.h"

#include <packet/hit.h>

#include <cstdint>
#include <new>
#include <stdexcept>
#include <utility>
#include <vector>

namespace packet {
namespace {

/// What became of a mesh of the file.
struct AddedMesh {
    std::uint32_t mesh_id = kInvalidId;  ///< in the scene; without triangles it is not there
    std::size_t skipped_primitives = 0;
};

std::vector<AddedMesh> add_meshes(const gltf::Document& document,
                                  const std::vector<gltf::Placement>& placements, Scene& scene) {
    std::vector<bool> is_placed(document.model.meshes.size());
    for (const gltf::Placement& placement : placements) is_placed[placement.mesh_id] = true;

    gltf::MemoryBudget budget(document.byte_count, document.errors);
    std::vector<AddedMesh> added(is_placed.size());
    for (std::size_t id = 0; id < is_placed.size(); ++id) {
        if (!is_placed[id]) continue;
        gltf::LoadedMesh loaded = gltf::load_mesh(document, budget, id);
        added[id].skipped_primitives = loaded.skipped_primitives;
        if (loaded.mesh.triangles.empty()) continue;
        added[id].mesh_id = scene.add_mesh(std::move(loaded.mesh));
    }
    return added;
}

/// Whether the instance could be added; its transform may be singular, and is finite.
bool try_add_instance(Scene& scene, std::uint32_t mesh_id, const glm::mat4x3& world_from_object) {
    try {
        scene.add_instance(mesh_id, world_from_object);
    } catch (const Error& error) {
        if (error.code() == ErrorCode::kBadValue) return false;
        throw;
    }
    return true;
}

GltfScene make_gltf_scene(const gltf::Document& document) {
    GltfScene result;
    const std::vector<gltf::Placement> placements = gltf::place_meshes(document);
    const std::vector<AddedMesh> added = add_meshes(document, placements, result.scene);
    for (const gltf::Placement& placement : placements) {
        const AddedMesh& mesh = added[placement.mesh_id];
        result.skipped_primitives += mesh.skipped_primitives;
        if (mesh.mesh_id == kInvalidId) continue;
        if (!try_add_instance(result.scene, mesh.mesh_id, placement.world_from_object)) {
            ++result.skipped_instances;
        }
    }
    return result;
}

/// Turns the exceptions of a failed allocation into an Error. What a file may ask for is bounded,
/// but less may be there.
template <class Load>
GltfScene within_memory(const std::filesystem::path& path, Load load) {
    try {
        return load();
    } catch (const std::bad_alloc&) {
        throw Error(ErrorCode::kTooLarge, path.string() + ": needs more memory than there is");
    } catch (const std::length_error&) {
        throw Error(ErrorCode::kTooLarge, path.string() + ": needs more memory than can be");
    }
}

}  // namespace

GltfScene load_gltf(std::span<const std::byte> bytes, const std::filesystem::path& path) {
    return within_memory(path, [&] { return make_gltf_scene(gltf::read_document(bytes, path)); });
}

GltfScene load_gltf(const std::filesystem::path& path) {
    return within_memory(path, [&] { return load_gltf(gltf::read_file(path), path); });
}

}  // namespace packet
