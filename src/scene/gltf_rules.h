// Which properties of a glTF file are read, and what each must be. All others are dropped unseen.
//
// Khronos Group. glTF 2.0 specification, section 5: properties reference. 2021.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string_view>

namespace packet::gltf {

enum class Kind : std::uint8_t { kObject, kArray, kString, kBool, kNumber, kIndex, kSize };
enum class Need : std::uint8_t { kOptional, kRequired };
/// Whether a value goes into the JSON for tinygltf or into FilteredJson's own fields.
enum class Use : std::uint8_t { kModel, kField };

struct Rule {
    std::string_view path;
    Kind kind;
    Need need = Need::kOptional;
    Use use = Use::kModel;
    std::size_t size = 0;  ///< how many elements an array has; 0: any number
};

/// An array of so many numbers.
constexpr Rule numbers(std::string_view path, std::size_t size) {
    return {path, Kind::kArray, Need::kOptional, Use::kModel, size};
}

// A parent stands above its children.
inline constexpr Rule kRules[] = {
    {"", Kind::kObject},
    {"asset", Kind::kObject, Need::kRequired},
    {"asset.version", Kind::kString, Need::kRequired},
    {"scene", Kind::kIndex},
    {"scenes", Kind::kArray},
    {"scenes[]", Kind::kObject},
    {"scenes[].nodes", Kind::kArray},
    {"scenes[].nodes[]", Kind::kIndex},
    {"nodes", Kind::kArray},
    {"nodes[]", Kind::kObject},
    {"nodes[].mesh", Kind::kIndex},
    {"nodes[].children", Kind::kArray},
    {"nodes[].children[]", Kind::kIndex},
    numbers("nodes[].matrix", 16),
    {"nodes[].matrix[]", Kind::kNumber},
    numbers("nodes[].translation", 3),
    {"nodes[].translation[]", Kind::kNumber},
    numbers("nodes[].rotation", 4),
    {"nodes[].rotation[]", Kind::kNumber},
    numbers("nodes[].scale", 3),
    {"nodes[].scale[]", Kind::kNumber},
    {"meshes", Kind::kArray},
    {"meshes[]", Kind::kObject},
    {"meshes[].name", Kind::kString},
    {"meshes[].primitives", Kind::kArray, Need::kRequired},
    {"meshes[].primitives[]", Kind::kObject},
    {"meshes[].primitives[].attributes", Kind::kObject, Need::kRequired},
    {"meshes[].primitives[].attributes.POSITION", Kind::kIndex},
    {"meshes[].primitives[].indices", Kind::kIndex},
    {"meshes[].primitives[].mode", Kind::kIndex},
    {"meshes[].primitives[].extensions", Kind::kObject},
    {"meshes[].primitives[].extensions.KHR_draco_mesh_compression", Kind::kObject},
    {"accessors", Kind::kArray},
    {"accessors[]", Kind::kObject},
    {"accessors[].bufferView", Kind::kIndex},
    {"accessors[].byteOffset", Kind::kSize},
    {"accessors[].componentType", Kind::kIndex, Need::kRequired},
    {"accessors[].normalized", Kind::kBool},
    {"accessors[].count", Kind::kSize, Need::kRequired},
    {"accessors[].type", Kind::kString, Need::kRequired},
    {"accessors[].sparse", Kind::kObject},
    {"accessors[].sparse.count", Kind::kIndex, Need::kRequired},
    {"accessors[].sparse.indices", Kind::kObject, Need::kRequired},
    {"accessors[].sparse.indices.bufferView", Kind::kIndex, Need::kRequired},
    {"accessors[].sparse.indices.byteOffset", Kind::kIndex},
    {"accessors[].sparse.indices.componentType", Kind::kIndex, Need::kRequired},
    {"accessors[].sparse.values", Kind::kObject, Need::kRequired},
    {"accessors[].sparse.values.bufferView", Kind::kIndex, Need::kRequired},
    {"accessors[].sparse.values.byteOffset", Kind::kIndex},
    {"bufferViews", Kind::kArray},
    {"bufferViews[]", Kind::kObject},
    {"bufferViews[].buffer", Kind::kIndex, Need::kRequired},
    {"bufferViews[].byteOffset", Kind::kSize},
    {"bufferViews[].byteLength", Kind::kSize, Need::kRequired},
    {"bufferViews[].byteStride", Kind::kSize},
    {"buffers", Kind::kArray, Need::kOptional, Use::kField},
    {"buffers[]", Kind::kObject, Need::kOptional, Use::kField},
    {"buffers[].uri", Kind::kString, Need::kOptional, Use::kField},
    {"buffers[].byteLength", Kind::kSize, Need::kRequired, Use::kField},
    {"extensionsRequired", Kind::kArray, Need::kOptional, Use::kField},
    {"extensionsRequired[]", Kind::kString, Need::kOptional, Use::kField},
};
inline constexpr std::size_t kRuleCount = std::size(kRules);
static_assert(kRuleCount <= 64, "sets of rules are 64-bit masks");

/// A rule's place in the tree that the paths span.
struct RuleNode {
    std::string_view name;  ///< last part of the path; of an array's elements "[]"
    std::size_t parent = kRuleCount;
    std::uint64_t required = 0;  ///< children that must be there, a bit each
};

consteval std::size_t find_path(std::string_view path) {
    for (std::size_t i = 0; i < kRuleCount; ++i) {
        if (kRules[i].path == path) return i;
    }
    throw "a rule without a parent";
}

/// The rules' tree, index by index.
consteval std::array<RuleNode, kRuleCount> make_tree() {
    std::array<RuleNode, kRuleCount> tree;
    for (std::size_t i = 1; i < kRuleCount; ++i) {
        const std::string_view path = kRules[i].path;
        const bool is_element = path.ends_with("[]");
        const std::size_t dot = path.rfind('.');
        const std::size_t cut = is_element ? path.size() - 2 : dot == path.npos ? 0 : dot;
        tree[i].name = path.substr(is_element || cut == 0 ? cut : cut + 1);
        tree[i].parent = find_path(path.substr(0, cut));
        if (kRules[i].need == Need::kRequired) {
            tree[tree[i].parent].required |= std::uint64_t{1} << i;
        }
    }
    return tree;
}
inline constexpr std::array<RuleNode, kRuleCount> kTree = make_tree();

/// The rule of what an object calls `name`, or of an array's elements; kRuleCount if there is none.
inline std::size_t find_child(std::size_t parent, std::string_view name) {
    for (std::size_t i = parent + 1; i < kRuleCount; ++i) {
        if (kTree[i].parent == parent && kTree[i].name == name) return i;
    }
    return kRuleCount;
}

}  // namespace packet::gltf
