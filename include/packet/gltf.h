// Loads glTF 2.0 scenes.
#pragma once

#include <packet/scene.h>

#include <cstddef>
#include <filesystem>

namespace packet {

struct GltfScene {
    Scene scene;  ///< not yet committed
    /// Primitives that are not triangles (points, lines) or have no positions, skipped; counted
    /// once for each instance.
    std::size_t skipped_primitives = 0;
    /// Nodes with a mesh whose transform cannot be inverted, skipped: a scale of zero hides a node.
    std::size_t skipped_instances = 0;
};

/// Loads the default scene of a .gltf or .glb file (or all root nodes if it names none). Each glTF
/// mesh that is placed and has triangles becomes one mesh, in the file's order (its triangle
/// primitives in order: lists, strips, fans), and each node that refers to it, depth first, one
/// instance. Images, materials, cameras and animations are not read, skins and morph targets are
/// not applied. Buffers may be in the file or in files in its folder. Time and memory are linear in
/// the bytes of the file and its buffers.
///
/// Files are taken as hostile: throws Error{kIo} if one cannot be read and Error{kBadFile} naming
/// the file, the object and its index if it is truncated, malformed or refers outside itself;
/// Error{kUnsupported} if it requires an extension that hides geometry (such as Draco's
/// compression); Error{kTooLarge} if it would fill more than 256 MiB and 64 bytes a byte of file,
/// as it might where accessors overlap or millions of nodes are empty.
[[nodiscard]] GltfScene load_gltf(const std::filesystem::path& path);

}  // namespace packet
