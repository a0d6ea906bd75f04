// Rays and hits as NumPy array files, in the layout they have in memory.
#pragma once

#include "output_file.h"

#include <packet/hit.h>
#include <packet/ray.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace packet::tools {

/// Reads rays: little-endian float32 of shape (n, 8) in C order, org.xyz, tnear, dir.xyz, tfar, of
/// NPY version 1.0, 2.0 or 3.0. The values may be any. The file is taken as hostile: throws
/// Error{kIo} if it cannot be read and Error{kBadFile} naming it if it is not exactly that.
/// Memory beyond the rays themselves is constant.
[[nodiscard]] std::vector<Ray> read_rays(const std::filesystem::path& path);

/// Writes rays as read_rays() takes them. This and the two below commit the file; they throw
/// Error{kIo}, and nothing stays then.
void write_rays(OutputFile file, std::span<const Ray> rays);

/// Writes n records [('t','<f4'), ('u','<f4'), ('v','<f4'), ('prim_id','<u4'), ('mesh_id','<u4'),
/// ('instance_id','<u4')].
void write_hits(OutputFile file, std::span<const Hit> hits);

/// Writes n bytes, 1 where a ray hits anything.
void write_occluded(OutputFile file, std::span<const std::uint8_t> occluded);

}  // namespace packet::tools
