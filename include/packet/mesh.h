// Triangle meshes: one that owns its arrays, and a view of one.
#pragma once

#include <packet/bounds.h>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace packet {

/// Vertex positions and three vertex indices a triangle, owned by somebody else.
struct MeshView {
    std::span<const glm::vec3> positions;
    std::span<const glm::uvec3> triangles;
};

/// An indexed triangle mesh. A triangle's `prim_id` is its place in `triangles`.
struct TriangleMesh {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    std::string name;

    [[nodiscard]] MeshView view() const noexcept { return {positions, triangles}; }
};

/// Triangles that can never be hit, by reason. A triangle counts once, under the first that fits.
struct SkippedTriangles {
    std::size_t non_finite = 0;  ///< a vertex has a NaN or an infinity
    std::size_t too_large = 0;   ///< a coordinate is beyond 1.8e18, so products would overflow
    std::size_t zero_area = 0;   ///< the corners lie on one line

    [[nodiscard]] std::size_t total() const noexcept { return non_finite + too_large + zero_area; }
};

/// Throws Error{kBadIndex} that names the first triangle with a vertex index out of range, and
/// Error{kTooLarge} for more than 2^31 - 2 triangles. O(n).
void validate(MeshView mesh);

}  // namespace packet
