// Builds on the device whose results are copied to the host, to be looked at there: for tests.
#pragma once

#include "build/hierarchy.h"
#include "core/views.h"

#include <packet/accel.h>

#include <array>
#include <span>
#include <vector>

namespace packet::cuda {

/// By build_bvh_morton(), of any boxes.
[[nodiscard]] Hierarchy download_bvh_morton(std::span<const Reference> references,
                                            const BuildOptions& options);

/// By build_hierarchy().
[[nodiscard]] Hierarchy download_hierarchy(MeshView mesh, const BuildOptions& options);

struct DownloadedTree {
    std::vector<Node> nodes;
    std::vector<std::array<float, 12>> triangles;  ///< as DeviceTriangle
    Bounds3f bounds;
    int depth = 0;
};
/// The same, laid out.
[[nodiscard]] DownloadedTree download_tree(MeshView mesh, const BuildOptions& options);

}  // namespace packet::cuda
