// Writes meshes as binary glTF, directly from their arrays: a mesh may take most of the memory.
//
// Khronos Group. glTF 2.0 Specification, 4.4 "GLB File Format Specification".
#include "write_glb.h"

#include <packet/bounds.h>
#include <packet/error.h>

#include <nlohmann/json.hpp>

#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <string>

namespace packet::tools {
namespace {

using nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little,
              "buffers are written as they lie in memory");
static_assert(sizeof(glm::vec3) == 12 && sizeof(glm::uvec3) == 12);

// The numbers by which glTF names types and targets.
constexpr int kFloat = 5126, kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;

ordered_json describe_accessors(const TriangleMesh& mesh) {
    Bounds3f bounds;
    for (const glm::vec3& position : mesh.positions) bounds.extend(position);
    const auto list = [](const glm::vec3& v) { return ordered_json::array({v.x, v.y, v.z}); };
    const ordered_json positions = {
        {"bufferView", 0}, {"componentType", kFloat},   {"count", mesh.positions.size()},
        {"type", "VEC3"},  {"min", list(bounds.lower)}, {"max", list(bounds.upper)}};
    const ordered_json indices = {{"bufferView", 1},
                                  {"componentType", kUnsignedInt},
                                  {"count", 3 * mesh.triangles.size()},
                                  {"type", "SCALAR"}};
    return ordered_json::array({positions, indices});
}

ordered_json describe_views(std::size_t position_bytes, std::size_t index_bytes) {
    const ordered_json positions = {
        {"buffer", 0}, {"byteLength", position_bytes}, {"target", kArrayBuffer}};
    const ordered_json indices = {{"buffer", 0},
                                  {"byteOffset", position_bytes},
                                  {"byteLength", index_bytes},
                                  {"target", kElementArrayBuffer}};
    return ordered_json::array({positions, indices});
}

/// The file's JSON: one scene of one node of one mesh.
std::string describe(const TriangleMesh& mesh, std::size_t position_bytes,
                     std::size_t index_bytes) {
    const auto array_of = [](const ordered_json& value) { return ordered_json::array({value}); };
    const ordered_json primitive = {{"attributes", {{"POSITION", 0}}}, {"indices", 1}};
    ordered_json gltf;
    gltf["asset"] = {{"version", "2.0"}, {"generator", "packet make"}};
    gltf["scene"] = 0;
    gltf["scenes"] = array_of({{"nodes", array_of(0)}});
    gltf["nodes"] = array_of({{"mesh", 0}, {"name", mesh.name}});
    gltf["meshes"] = array_of({{"name", mesh.name}, {"primitives", array_of(primitive)}});
    gltf["accessors"] = describe_accessors(mesh);
    gltf["bufferViews"] = describe_views(position_bytes, index_bytes);
    gltf["buffers"] = array_of({{"byteLength", position_bytes + index_bytes}});
    std::string text = gltf.dump();
    text.append((4 - text.size() % 4) % 4, ' ');  // chunks are aligned to 4 bytes
    return text;
}

}  // namespace

void write_glb(OutputFile file, const TriangleMesh& mesh) {
    if (mesh.triangles.empty())
        throw Error(ErrorCode::kBadValue, "cannot write an empty mesh as glTF");
    const auto positions = std::as_bytes(std::span(mesh.positions));
    const auto indices = std::as_bytes(std::span(mesh.triangles));
    const std::string json = describe(mesh, positions.size(), indices.size());

    constexpr std::size_t kHeaders = 12 + 2 * 8;  // the file's and two chunks'
    const std::size_t total = kHeaders + json.size() + positions.size() + indices.size();
    if (total > std::numeric_limits<std::uint32_t>::max()) {
        throw Error(ErrorCode::kTooLarge, "a .glb file of " + std::to_string(total) +
                                              " bytes is asked for; it can have 2^32 - 1");
    }
    const auto write_word = [&](std::size_t word) {
        const auto value = static_cast<std::uint32_t>(word);
        file.write(std::as_bytes(std::span(&value, 1)));
    };
    constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2;  // "glTF"
    constexpr std::uint32_t kJson = 0x4E4F534A, kBin = 0x004E4942;
    for (const std::size_t word : {std::size_t{kMagic}, std::size_t{kVersion}, total})
        write_word(word);
    write_word(json.size());
    write_word(kJson);
    file.write(json);
    write_word(positions.size() + indices.size());
    write_word(kBin);
    file.write(positions);
    file.write(indices);
    file.commit();
}

}  // namespace packet::tools
