#include "walkable.h"

#include <packet/error.h>

#include <string>

namespace packet::cuda {

void require_walkable(const TreeView& tree, std::size_t mesh_id) {
    const auto fail = [&](const char* what) {
        throw Error(ErrorCode::kUnsupported, "mesh " + std::to_string(mesh_id) + what);
    };
    if (tree.grid.bricks != nullptr) {
        fail(" is in a grid, which CUDA devices do not walk: choose a tree");
    }
    if (tree.nodes == nullptr && tree.node_count != 0) {
        fail(
            " has no binary nodes, which CUDA devices walk: build with "
            "BuildOptions::keep_binary_nodes");
    }
}

}  // namespace packet::cuda
