// What builders sort: boxes with the id of what is in them.
#pragma once

#include "core/aligned_vector.h"
#include "schedule/parallel.h"

#include <packet/bounds.h>
#include <packet/mesh.h>

#include <cstdint>
#include <span>

namespace packet {

/// The box of an item (a triangle or an instance), in half a cache line.
struct Reference {
    glm::vec3 lower;
    std::uint32_t id;
    glm::vec3 upper;
    std::uint32_t unused = 0;

    [[nodiscard]] constexpr Bounds3f bounds() const noexcept { return {lower, upper}; }
};
static_assert(sizeof(Reference) == 32);

struct References {
    ScratchVector<Reference> items;
    Bounds3f bounds;
    SkippedTriangles skipped;
};

/// Copies the ids of references. O(n), parallel.
[[nodiscard]] ScratchVector<std::uint32_t> ids_of(std::span<const Reference> references,
                                                  const Parallel& parallel);

/// One reference a triangle that can be hit, in order of the triangles. O(n), parallel.
[[nodiscard]] References collect_references(MeshView mesh, const Parallel& parallel);

}  // namespace packet
