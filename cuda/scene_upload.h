// A scene's arrays in the device's memory, and the views of them that kernels take.
#pragma once

#include "memory.h"
#include "views.h"

#include <vector>

namespace packet {
struct SceneAccel;
}

namespace packet::cuda {

class UploadedScene {
public:
    /// Throws Error{kUnsupported} for grids.
    explicit UploadedScene(const SceneAccel& accel);

    [[nodiscard]] const SceneView& view() const noexcept { return view_; }
    /// Entries that the stack of any walk needs: the top tree's depth and the deepest mesh's.
    [[nodiscard]] std::uint32_t stack_depth() const noexcept { return stack_depth_; }

private:
    struct TreeArrays {
        DeviceArray<Node> nodes;
        DeviceArray<DeviceTriangle> triangles;
    };

    [[nodiscard]] DeviceTree upload(const TreeView& tree, std::size_t block_count);

    std::vector<TreeArrays> arrays_;
    DeviceArray<DeviceTree> trees_;
    DeviceArray<InstanceView> instances_;
    DeviceArray<std::uint32_t> mesh_of_instance_;
    SceneView view_;
    std::uint32_t stack_depth_ = 0;
};

}  // namespace packet::cuda
