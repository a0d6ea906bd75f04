// Writes meshes as binary glTF.
#pragma once

#include "output_file.h"

#include <packet/mesh.h>

namespace packet::tools {

/// Writes a .glb file whose scene is this mesh, and commits it. The file holds the vertices bit for
/// bit. Throws Error{kTooLarge} if that takes 4 GiB or more, Error{kBadValue} if the mesh has no
/// triangle (glTF knows no empty meshes) and Error{kIo}; nothing stays then.
void write_glb(OutputFile file, const TriangleMesh& mesh);

}  // namespace packet::tools
