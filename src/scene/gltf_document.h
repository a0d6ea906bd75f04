// A glTF file as tinygltf's model of it, with its buffers' bytes. This and what includes it is all
// that uses tinygltf.
#pragma once

#include "scene/gltf_errors.h"

#include <tiny_gltf.h>
#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

namespace packet::gltf {

struct Document {
    FileErrors errors;
    /// Holds scenes, nodes, meshes, accessors and buffer views only. Indices may point at nothing.
    tinygltf::Model model;
    /// The bytes of each buffer, in `storage` or in the file's binary chunk.
    std::vector<std::span<const std::byte>> buffers;
    std::vector<std::vector<std::byte>> storage;
    /// Of the JSON and all distinct buffers.
    std::size_t byte_count = 0;
};

/// Throws Error{kIo} if the file cannot be read.
[[nodiscard]] std::vector<std::byte> read_file(const std::filesystem::path& path);

/// Reads a .gltf or .glb that is in memory; the document keeps a view of `bytes`. The path names it
/// in errors, and its folder is where buffers in files of their own are. Throws Error{kBadFile},
/// Error{kUnsupported} for a required extension that hides geometry, Error{kIo} for such a buffer.
[[nodiscard]] Document read_document(std::span<const std::byte> bytes,
                                     const std::filesystem::path& path);

}  // namespace packet::gltf
