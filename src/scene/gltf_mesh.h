// Makes one triangle mesh of a glTF mesh's primitives.
#pragma once

#include "scene/gltf_accessor.h"

#include <packet/mesh.h>

#include <cstddef>

namespace packet::gltf {

struct LoadedMesh {
    TriangleMesh mesh;  ///< without triangles if all primitives were skipped or empty
    std::size_t skipped_primitives = 0;  ///< points, lines, and those without positions
};

/// Concatenates the triangles of a mesh's primitives in order: lists, strips and fans, indexed or
/// not. Vertices that primitives share are stored once. Vertices left over after the last whole
/// triangle are ignored, as OpenGL does. `mesh_id` must be in range. Throws Error{kBadFile} naming
/// mesh, primitive and accessor, and errors as AccessorReader does.
[[nodiscard]] LoadedMesh load_mesh(const Document& document, MemoryBudget& budget,
                                   std::size_t mesh_id);

}  // namespace packet::gltf
