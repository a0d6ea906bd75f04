#include "device_build.h"

#include "device_references.h"
#include "downloaded_build.h"
#include "kd_build.h"
#include "lay_out.h"
#include "morton_build.h"

#include <packet/error.h>

#include <cstring>
#include <string>

namespace packet::cuda {

DeviceHierarchy build_hierarchy(const UploadedMesh& mesh, const BuildOptions& options) {
    const AccelKind kind = chosen_accel(options);
    const bool by_levels = options.kd_build == KdBuild::kBreadthFirst;
    if (kind != AccelKind::kBvhMorton && !(kind == AccelKind::kKdSah && by_levels)) {
        throw Error(ErrorCode::kUnsupported,
                    "CUDA devices build bvh-morton and breadth-first kd-sah, not " +
                        std::string(to_string(kind)));
    }
    DeviceReferences references = collect_references(mesh);
    if (kind == AccelKind::kBvhMorton) {
        return build_bvh_morton(std::move(references.items), references.count, options);
    }
    return build_kd_levels(mesh, std::move(references.items), references.count, options);
}

Hierarchy download_bvh_morton(std::span<const Reference> references, const BuildOptions& options) {
    const auto count = static_cast<std::uint32_t>(references.size());
    return build_bvh_morton(DeviceArray<Reference>(references), count, options).download();
}

Hierarchy download_hierarchy(MeshView mesh, const BuildOptions& options) {
    return build_hierarchy(UploadedMesh(mesh), options).download();
}

DownloadedTree download_tree(MeshView mesh, const BuildOptions& options) {
    const UploadedMesh uploaded(mesh);
    const DeviceHierarchy hierarchy = build_hierarchy(uploaded, options);
    const DeviceBuiltTree tree = lay_out(hierarchy, uploaded);
    const Stream stream;
    DownloadedTree out{{}, {}, tree.bounds, tree.depth};
    out.nodes.resize(tree.node_count);
    std::vector<DeviceTriangle> triangles(hierarchy.reference_count);
    tree.arrays.nodes.copy_to(out.nodes, stream.get());
    tree.arrays.triangles.copy_to(triangles, stream.get());
    stream.synchronize();
    out.triangles.resize(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        std::memcpy(out.triangles[i].data(), &triangles[i], sizeof(DeviceTriangle));
    }
    return out;
}

}  // namespace packet::cuda
