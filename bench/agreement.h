// Whether two tracers that round differently saw the same. A speed is worth comparing only then.
#pragma once

#include <packet/hit.h>
#include <packet/mesh.h>
#include <packet/ray.h>

#include <cstddef>
#include <span>

namespace packet::bench {

/// Rays by how the answers compare. Distances count as equal within 1e-5 of themselves or of the
/// largest coordinate in play, whichever is larger.
struct Agreement {
    /// The same triangle at the same distance, or both missed.
    std::size_t same = 0;
    /// Another triangle at the same distance, as at a shared edge.
    std::size_t tied = 0;
    /// They differ, where rounding decides whether the nearer hit is one.
    std::size_t borderline = 0;
    /// They differ, and one of them is wrong.
    std::size_t different = 0;

    [[nodiscard]] std::size_t rays() const noexcept { return same + tied + borderline + different; }
    /// No more than a few rays in a million are different.
    [[nodiscard]] bool acceptable() const noexcept;
};

/// Compares closest hits whose `prim_id` counts the triangles of `mesh`. What differs is judged in
/// double precision: the nearer of two hits must be one, well within its triangle, to be believed.
[[nodiscard]] Agreement compare_hits(MeshView mesh, std::span<const Ray> rays,
                                     std::span<const Hit> ours, std::span<const Hit> theirs);

}  // namespace packet::bench
