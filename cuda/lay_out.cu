#include "lay_out.h"

#include "item_launch.h"

#include <vector>

namespace packet::cuda {

namespace {

/// Part of the list of nodes by level.
struct LevelSpan {
    std::uint32_t begin, end;
};

/// Lists the children of a level's nodes behind it, in whatever order.
__global__ void list_children(const BuildNode* nodes, LevelSpan level, std::uint32_t* list,
                              std::uint32_t* list_size) {
    const unsigned i = level.begin + thread_in_grid();
    if (i >= level.end) return;
    const BuildNode& node = nodes[list[i]];
    if (node.is_leaf()) return;
    const std::uint32_t place = atomicAdd(list_size, 2u);
    list[place] = node.first;
    list[place + 1] = node.second;
}

/// How many nodes a subtree has, for a level whose children have been counted.
__global__ void count_nodes(const BuildNode* nodes, LevelSpan level, const std::uint32_t* list,
                            std::uint32_t* sizes) {
    const unsigned i = level.begin + thread_in_grid();
    if (i >= level.end) return;
    const BuildNode& node = nodes[list[i]];
    sizes[list[i]] = node.is_leaf() ? 1 : 1 + sizes[node.first] + sizes[node.second];
}

/// Depth first the first child follows its parent, and the second all that is below the first.
__global__ void place_nodes(const BuildNode* nodes, LevelSpan level, const std::uint32_t* list,
                            const std::uint32_t* sizes, std::uint32_t* places, Node* out) {
    const unsigned i = level.begin + thread_in_grid();
    if (i >= level.end) return;
    const BuildNode& node = nodes[list[i]];
    const std::uint32_t place = places[list[i]];
    std::uint32_t link = node.first;
    if (!node.is_leaf()) {
        places[node.first] = place + 1;
        link = places[node.second] = place + 1 + sizes[node.first];
    }
    const Bounds3f& box = node.bounds;
    out[place] = {
        {{box.lower.x, box.lower.y, box.lower.z}, {box.upper.x, box.upper.y, box.upper.z}},
        link,
        node.count};
}

__global__ void fill_triangles(const Reference* references, std::uint32_t count, DeviceMesh mesh,
                               DeviceTriangle* out) {
    const unsigned i = thread_in_grid();
    if (i >= count) return;
    const std::uint32_t id = references[i].id;
    for (int c = 0; c < 3; ++c) {
        const glm::vec3 p = mesh.positions[mesh.triangles[id][c]];
        out[i].corner[c] = {p.x, p.y, p.z, c == 0 ? __uint_as_float(id) : 0.0f};
    }
}

}  // namespace

DeviceTree DeviceBuiltTree::view() const noexcept {
    DeviceTree out;
    out.nodes = arrays.nodes.data();
    out.triangles = arrays.triangles.data();
    out.node_count = node_count;
    for (int a = 0; a < 3 && node_count != 0; ++a) {
        out.lower[a] = bounds.lower[a];
        out.upper[a] = bounds.upper[a];
    }
    return out;
}

DeviceBuiltTree lay_out(const DeviceHierarchy& hierarchy, const UploadedMesh& mesh) {
    DeviceBuiltTree out;
    if (hierarchy.reference_count == 0) return out;
    const Stream stream;
    const BuildNode* const nodes = hierarchy.nodes.data();
    const std::uint32_t room = hierarchy.node_count;
    DeviceArray<std::uint32_t> list(room), sizes(room), places(room), list_size(1);
    const std::uint32_t root = 0, one = 1;
    list.copy_from({&root, 1}, stream.get());
    places.copy_from({&root, 1}, stream.get());
    list_size.copy_from({&one, 1}, stream.get());

    std::vector<LevelSpan> levels;
    for (LevelSpan level{0, 1}; level.begin != level.end;) {
        levels.push_back(level);
        for_each_item(level.end - level.begin, stream, list_children, nodes, level, list.data(),
                      list_size.data());
        level = {level.end, list_size.value(0, stream)};
    }
    out.depth = static_cast<int>(levels.size()) - 1;
    out.node_count = levels.back().end;
    out.bounds = hierarchy.nodes.value(0, stream).bounds;
    out.arrays.nodes.make_room(out.node_count);
    out.arrays.triangles.make_room(hierarchy.reference_count);
    for (std::size_t i = levels.size(); i-- > 0;) {
        const LevelSpan& level = levels[i];
        for_each_item(level.end - level.begin, stream, count_nodes, nodes, level, list.data(),
                      sizes.data());
    }
    for (const LevelSpan& level : levels) {
        for_each_item(level.end - level.begin, stream, place_nodes, nodes, level, list.data(),
                      sizes.data(), places.data(), out.arrays.nodes.data());
    }
    for_each_item(hierarchy.reference_count, stream, fill_triangles, hierarchy.references.data(),
                  hierarchy.reference_count, mesh.view(), out.arrays.triangles.data());
    stream.synchronize();  // before what it worked with is given back
    return out;
}

}  // namespace packet::cuda
