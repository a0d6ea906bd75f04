// Reduces a glTF file's JSON to what places triangles, checked property by property, for tinygltf
// to make a model of.
//
// tinygltf (2.7 to 2.9) is made for good files. It takes a property of the wrong type as absent and
// cuts integers to 32 bits, so broken files become wrong scenes; it recurses over extras, so deep
// ones overflow the stack; it opens and decodes images; it turns three bytes of material into
// kilobytes. Here it never sees such things.
#pragma once

#include "scene/gltf_errors.h"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace packet::gltf {

/// Where a buffer's bytes are; without a URI they are the file's binary chunk.
struct BufferSource {
    std::optional<std::string> uri;
    std::size_t byte_length = 0;
};

struct FilteredJson {
    /// Scenes, nodes, meshes, accessors and buffer views. Known properties only, of the right
    /// types, none required missing; indices are below 2^31 but may still point at nothing.
    std::string json;
    std::vector<BufferSource> buffers;
    std::vector<std::string> required_extensions;
    /// How many there are, for blaming the right one if tinygltf stops half way.
    std::size_t buffer_view_count = 0, accessor_count = 0, mesh_count = 0;
};

/// O(n) time whatever the nesting, no recursion. Throws Error{kBadFile} by way of
/// `errors`, or Error{kTooLarge} if objects are so many and small that the model would outgrow it.
[[nodiscard]] FilteredJson filter_json(std::string_view text, const FileErrors& errors);

}  // namespace packet::gltf
