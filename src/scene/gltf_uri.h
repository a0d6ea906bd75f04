// The URIs by which a glTF file names its buffers: bytes in base64, or a file in its folder.
#pragma once

#include "scene/gltf_errors.h"

#include <cstddef>
#include <filesystem>
#include <string_view>
#include <vector>

namespace packet::gltf {

[[nodiscard]] bool is_data_uri(std::string_view uri);

/// The bytes of a data URI. Throws Error{kBadFile} naming `buffer_id` if it is not sound base64.
[[nodiscard]] std::vector<std::byte> decode_data_uri(std::string_view uri, std::size_t buffer_id,
                                                     const FileErrors& errors);

/// The file that a URI names, relative to the glTF file's folder. Throws Error{kBadFile} if the URI
/// is absolute, has a scheme, or leads out of the folder. Links inside the folder are the user's
/// own.
[[nodiscard]] std::filesystem::path resolve_file_uri(std::string_view uri, std::size_t buffer_id,
                                                     const FileErrors& errors);

}  // namespace packet::gltf
