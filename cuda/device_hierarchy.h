// What builds on the device hand on, and what they take: as Hierarchy and MeshView.
#pragma once

#include "build/hierarchy.h"
#include "memory.h"

#include <packet/mesh.h>

namespace packet::cuda {

struct DeviceHierarchy {
    DeviceArray<BuildNode> nodes;
    DeviceArray<Reference> references;
    std::uint32_t node_count = 0, reference_count = 0;

    [[nodiscard]] Hierarchy download() const {
        const Stream stream;
        Hierarchy out;
        out.nodes.resize(node_count);
        ScratchVector<Reference> items(reference_count);
        nodes.copy_to(out.nodes, stream.get());
        references.copy_to(items, stream.get());
        stream.synchronize();
        out.ids = ids_of(items, Parallel(1));
        return out;
    }
};

/// A mesh in the device's memory, as kernels see it.
struct DeviceMesh {
    const glm::vec3* positions;
    const glm::uvec3* triangles;
};

class UploadedMesh {
public:
    explicit UploadedMesh(MeshView mesh) : positions_(mesh.positions), triangles_(mesh.triangles) {}

    [[nodiscard]] DeviceMesh view() const noexcept {
        return {positions_.data(), triangles_.data()};
    }
    [[nodiscard]] std::uint32_t triangle_count() const noexcept {
        return static_cast<std::uint32_t>(triangles_.size());
    }

private:
    DeviceArray<glm::vec3> positions_;
    DeviceArray<glm::uvec3> triangles_;
};

}  // namespace packet::cuda
