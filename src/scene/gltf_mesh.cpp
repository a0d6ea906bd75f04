// Khronos Group. glTF 2.0 specification, section 3.7.2: meshes, for the winding of strips and fans.
// 2021.
#include "scene/gltf_mesh.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace packet::gltf {
namespace {

constexpr const char* kDraco = "KHR_draco_mesh_compression";

/// Vertices of a primitive, at one stretch within the mesh.
struct VertexRange {
    std::uint32_t first;
    std::uint32_t count;
};

class MeshLoader {
public:
    MeshLoader(const Document& document, MemoryBudget& budget, std::size_t mesh_id)
        : document_(document), budget_(budget), reader_(document, budget), mesh_id_(mesh_id) {}

    LoadedMesh load();

private:
    void add(const tinygltf::Primitive& primitive);
    void check_is_plain(const tinygltf::Primitive& primitive, int accessor_id) const;
    VertexRange add_positions(int accessor_id);
    std::vector<std::uint32_t> read_indices(int accessor_id, VertexRange vertices);
    template <class Corner>
    void add_triangles(int mode, std::size_t corner_count, Corner corner);
    template <class... Parts>
    [[noreturn]] void fail(const Parts&... parts) const {
        document_.errors.fail("mesh ", mesh_id_, ", primitive ", primitive_id_, ": ", parts...);
    }

    const Document& document_;
    MemoryBudget& budget_;
    AccessorReader reader_;
    std::size_t mesh_id_;
    std::size_t primitive_id_ = 0;
    LoadedMesh result_;
    std::map<int, VertexRange> ranges_;  ///< by accessor
};

LoadedMesh MeshLoader::load() {
    const tinygltf::Mesh& source = document_.model.meshes[mesh_id_];
    result_.mesh.name = source.name;
    for (const tinygltf::Primitive& primitive : source.primitives) {
        add(primitive);
        ++primitive_id_;
    }
    return std::move(result_);
}

void MeshLoader::add(const tinygltf::Primitive& primitive) {
    if (primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN) fail("has the unknown mode ", primitive.mode);
    const auto position = primitive.attributes.find("POSITION");
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES || position == primitive.attributes.end()) {
        ++result_.skipped_primitives;
        return;
    }
    check_is_plain(primitive, position->second);
    const VertexRange vertices = add_positions(position->second);
    if (primitive.indices < 0) {
        add_triangles(primitive.mode, vertices.count, [=](std::size_t i) {
            return vertices.first + static_cast<std::uint32_t>(i);
        });
        return;
    }
    const std::vector<std::uint32_t> indices = read_indices(primitive.indices, vertices);
    add_triangles(primitive.mode, indices.size(),
                  [&](std::size_t i) { return vertices.first + indices[i]; });
}

/// Throws if Draco's compressed positions are the only ones: without a view, the accessor is zeros.
void MeshLoader::check_is_plain(const tinygltf::Primitive& primitive, int accessor_id) const {
    const auto& accessors = document_.model.accessors;
    const auto id = static_cast<std::size_t>(accessor_id);
    if (!primitive.extensions.contains(kDraco) || id >= accessors.size()) return;
    if (accessors[id].bufferView >= 0 || accessors[id].sparse.isSparse) return;
    document_.errors.fail_as(ErrorCode::kUnsupported, "mesh ", mesh_id_, ", primitive ",
                             primitive_id_, ": is compressed by ", kDraco,
                             ", which cannot be read");
}

VertexRange MeshLoader::add_positions(int accessor_id) {
    const auto known = ranges_.find(accessor_id);
    if (known != ranges_.end()) return known->second;

    std::vector<glm::vec3>& all = result_.mesh.positions;
    std::vector<glm::vec3> positions = reader_.read_positions(accessor_id);
    if (positions.size() > std::numeric_limits<std::uint32_t>::max() - all.size()) {
        document_.errors.fail_as(ErrorCode::kTooLarge, "mesh ", mesh_id_,
                                 ": has more vertices than 32 bits can number");
    }
    const VertexRange range{static_cast<std::uint32_t>(all.size()),
                            static_cast<std::uint32_t>(positions.size())};
    if (all.empty()) {
        all = std::move(positions);
    } else {
        all.insert(all.end(), positions.begin(), positions.end());
    }
    ranges_.emplace(accessor_id, range);
    return range;
}

std::vector<std::uint32_t> MeshLoader::read_indices(int accessor_id, VertexRange vertices) {
    std::vector<std::uint32_t> indices = reader_.read_indices(accessor_id);
    const auto bad = std::ranges::find_if(indices, [=](auto i) { return i >= vertices.count; });
    if (bad != indices.end()) {
        fail("index ", bad - indices.begin(), " of accessor ", accessor_id, " is ", *bad,
             ", but there are ", vertices.count, " vertices");
    }
    return indices;
}

/// `corner(i)` is the vertex at place i of a list, strip or fan of `corner_count`.
template <class Corner>
void MeshLoader::add_triangles(int mode, std::size_t corner_count, Corner corner) {
    const bool is_list = mode == TINYGLTF_MODE_TRIANGLES;
    const std::size_t count =
        is_list ? corner_count / 3 : std::max<std::size_t>(corner_count, 2) - 2;
    std::vector<glm::uvec3>& triangles = result_.mesh.triangles;
    budget_.charge(count, sizeof(glm::uvec3), "mesh ", mesh_id_, ", triangles");
    const std::size_t first = triangles.size();
    triangles.resize(first + count);
    for (std::size_t i = 0; i < count; ++i) {
        glm::uvec3& triangle = triangles[first + i];
        if (is_list) {
            triangle = {corner(3 * i), corner(3 * i + 1), corner(3 * i + 2)};
        } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
            // Every other triangle swaps two corners, so that all face the same way.
            const std::size_t odd = i % 2;
            triangle = {corner(i), corner(i + 1 + odd), corner(i + 2 - odd)};
        } else {
            triangle = {corner(i + 1), corner(i + 2), corner(0)};
        }
    }
}

}  // namespace

LoadedMesh load_mesh(const Document& document, MemoryBudget& budget, std::size_t mesh_id) {
    return MeshLoader(document, budget, mesh_id).load();
}

}  // namespace packet::gltf
