#include "device_references.h"

#include "item_launch.h"
#include "prefix_sums.h"
#include "scene/triangle_fault.h"

namespace packet::cuda {

namespace {

struct Corners {
    glm::vec3 v0, v1, v2;
};
PACKET_DEVICE Corners corners_of(const DeviceMesh& mesh, std::uint32_t triangle) {
    const glm::uvec3 ids = mesh.triangles[triangle];
    return {mesh.positions[ids.x], mesh.positions[ids.y], mesh.positions[ids.z]};
}

__global__ void find_hittable(DeviceMesh mesh, std::uint32_t count, std::uint32_t* is_hittable) {
    const unsigned i = thread_in_grid();
    if (i >= count) return;
    const Corners c = corners_of(mesh, i);
    is_hittable[i] = find_fault(c.v0, c.v1, c.v2) == TriangleFault::kNone ? 1 : 0;
}

__global__ void fill_references(DeviceMesh mesh, std::uint32_t count, const std::uint32_t* places,
                                Reference* out) {
    const unsigned i = thread_in_grid();
    if (i >= count || places[i] == places[i + 1]) return;
    const Corners c = corners_of(mesh, i);
    Bounds3f box{c.v0, c.v0};
    box.extend(c.v1);
    box.extend(c.v2);
    out[places[i]] = {box.lower, i, box.upper};
}

}  // namespace

DeviceReferences collect_references(const UploadedMesh& mesh) {
    const std::uint32_t count = mesh.triangle_count();
    if (count == 0) return {};
    const Stream stream;
    DeviceArray<std::uint32_t> is_hittable(count), places(std::size_t{count} + 1);
    PrefixSums prefix_sums;
    for_each_item(count, stream, find_hittable, mesh.view(), count, is_hittable.data());
    prefix_sums(is_hittable.data(), places.data(), count, stream.get());
    DeviceReferences out;
    out.count = places.value(count, stream);
    out.items.make_room(out.count);
    for_each_item(count, stream, fill_references, mesh.view(), count, places.data(),
                  out.items.data());
    stream.synchronize();  // before the places are given back
    return out;
}

}  // namespace packet::cuda
