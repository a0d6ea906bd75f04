// References of a mesh's triangles, made on the device: as collect_references().
#pragma once

#include "device_hierarchy.h"

namespace packet::cuda {

struct DeviceReferences {
    DeviceArray<Reference> items;
    std::uint32_t count = 0;
};

/// One reference a triangle that can be hit, in order of the triangles.
[[nodiscard]] DeviceReferences collect_references(const UploadedMesh& mesh);

}  // namespace packet::cuda
