// Where a glTF file's nodes place its meshes.
#pragma once

#include "scene/gltf_document.h"

#include <glm/mat4x3.hpp>

#include <cstddef>
#include <vector>

namespace packet::gltf {

/// A node that refers to a mesh.
struct Placement {
    std::size_t node_id;
    std::size_t mesh_id;  ///< of the file; in range
    glm::mat4x3 world_from_object;
};

/// The placements of the default scene, or of all nodes if there is none, depth first. Transforms
/// are multiplied in double and are finite; they may be singular. O(n) time, no recursion. Throws
/// Error{kBadFile} if the nodes are not trees or a transform is not finite, naming the node.
[[nodiscard]] std::vector<Placement> place_meshes(const Document& document);

}  // namespace packet::gltf
