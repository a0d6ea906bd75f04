// load_gltf() for a file that is already in memory.
#pragma once

#include <packet/gltf.h>

#include <cstddef>
#include <filesystem>
#include <span>

namespace packet {

/// As load_gltf(path), but takes the file's bytes. The path names it in errors, and its folder is
/// where buffers in files of their own are.
[[nodiscard]] GltfScene load_gltf(std::span<const std::byte> bytes,
                                  const std::filesystem::path& path);

}  // namespace packet
