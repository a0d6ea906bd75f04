#include "scene/triangle_fault.h"

#include <packet/error.h>
#include <packet/mesh.h>

#include <string>

namespace packet {

void validate(MeshView mesh) {
    constexpr std::size_t kMostTriangles = 0x7FFFFFFE;
    if (mesh.triangles.size() > kMostTriangles) {
        throw Error(ErrorCode::kTooLarge, "mesh has " + std::to_string(mesh.triangles.size()) +
                                              " triangles; at most " +
                                              std::to_string(kMostTriangles) + " can be named");
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint32_t vertex = mesh.triangles[i][corner];
            if (vertex < mesh.positions.size()) continue;
            throw Error(ErrorCode::kBadIndex, "triangle " + std::to_string(i) +
                                                  " refers to vertex " + std::to_string(vertex) +
                                                  " of " + std::to_string(mesh.positions.size()));
        }
    }
}

void add_fault(SkippedTriangles& skipped, TriangleFault fault) noexcept {
    skipped.non_finite += fault == TriangleFault::kNonFinite;
    skipped.too_large += fault == TriangleFault::kTooLarge;
    skipped.zero_area += fault == TriangleFault::kZeroArea;
}

}  // namespace packet
