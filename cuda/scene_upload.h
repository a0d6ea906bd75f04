// A scene's arrays in the device's memory, and the views of them that kernels take.
#pragma once

#include "lay_out.h"
#include "memory.h"
#include "views.h"

#include <packet/scene.h>

#include <vector>

namespace packet {
struct SceneAccel;
}

namespace packet::cuda {

class UploadedScene {
public:
    /// Copies what the CPU has built. Throws Error{kUnsupported} for grids, and for trees without
    /// binary nodes.
    explicit UploadedScene(const SceneAccel& accel);
    /// Copies meshes and builds their trees on the device. Throws Error{kUnsupported} for
    /// structures that are not built there.
    UploadedScene(const Scene& scene, const BuildOptions& options);

    [[nodiscard]] const SceneView& view() const noexcept { return view_; }
    /// The box of all instances.
    [[nodiscard]] const Bounds3f& bounds() const noexcept { return bounds_; }
    /// Entries that the stack of any walk needs: the top tree's depth and the deepest mesh's.
    [[nodiscard]] std::uint32_t stack_depth() const noexcept { return stack_depth_; }

private:
    /// Once the meshes' trees are there, of which the deepest has `depth`.
    void upload_top(const SceneAccel& accel, std::span<const DeviceTree> trees, int depth);
    [[nodiscard]] DeviceTree upload(const TreeView& tree, std::size_t block_count);

    std::vector<TreeArrays> arrays_;
    DeviceArray<DeviceTree> trees_;
    DeviceArray<InstanceView> instances_;
    DeviceArray<std::uint32_t> mesh_of_instance_;
    SceneView view_;
    Bounds3f bounds_;
    std::uint32_t stack_depth_ = 0;
};

}  // namespace packet::cuda
