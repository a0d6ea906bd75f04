// Lays a hierarchy out depth first on the device, with its triangles: as make_tree(), for kernels.
#pragma once

#include "device_hierarchy.h"
#include "views.h"

namespace packet::cuda {

struct TreeArrays {
    DeviceArray<Node> nodes;
    DeviceArray<DeviceTriangle> triangles;
};

struct DeviceBuiltTree {
    TreeArrays arrays;
    std::uint32_t node_count = 0;
    Bounds3f bounds;
    int depth = 0;

    [[nodiscard]] DeviceTree view() const noexcept;
};

/// The nodes are those of make_tree(); items of leaves are the hierarchy's references in their
/// order. O(n), each level at once.
[[nodiscard]] DeviceBuiltTree lay_out(const DeviceHierarchy& hierarchy, const UploadedMesh& mesh);

}  // namespace packet::cuda
