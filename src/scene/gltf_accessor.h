// Reads accessors, the typed arrays of glTF. Every byte is proved to be inside of its view and its
// buffer before it is read, and every array to be within the budget before it is allocated.
//
// Khronos Group. glTF 2.0 specification, section 3.6: binary data storage. 2021.
#pragma once

#include "scene/gltf_document.h"
#include "scene/gltf_errors.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace packet::gltf {

class AccessorReader {
public:
    /// Both are kept by reference.
    AccessorReader(const Document& document, MemoryBudget& budget)
        : document_(document), budget_(budget) {}

    /// Three components of float, or of 8 or 16 bits as KHR_mesh_quantization allows; sparse or
    /// not. `accessor_id` may be any number. Throws Error{kBadFile} naming it, or Error{kTooLarge}.
    [[nodiscard]] std::vector<glm::vec3> read_positions(int accessor_id);

    /// Vertex indices of 8, 16 or 32 bits. Errors as above; the indices themselves are not judged.
    [[nodiscard]] std::vector<std::uint32_t> read_indices(int accessor_id);

private:
    const tinygltf::Accessor& find(int accessor_id) const;
    template <class Decode>
    auto read(int accessor_id, Decode decode);

    const Document& document_;
    MemoryBudget& budget_;
};

}  // namespace packet::gltf
