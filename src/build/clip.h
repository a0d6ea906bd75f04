// What of a triangle lies in a box: the part that a cell of space refers to.
//
// Sutherland, Hodgman. Reentrant polygon clipping. CACM 1974.
// Wald, Havran. On building fast kd-trees for ray tracing, and on doing that in O(N log N).
// Interactive Ray Tracing 2006 ("perfect splits").
#pragma once

#include "build/references.h"

namespace packet {

/// The bounds of the part of a triangle in `box`, within `box`; empty if there is none. Never too
/// small: every point of the triangle in the box, as real numbers, is in the result. Where rounding
/// makes it larger than need be, it does so by an ulp of the triangle's largest coordinate at most.
[[nodiscard]] Bounds3f clip_triangle(const glm::vec3 (&corners)[3], const Bounds3f& box);

/// A reference's parts on both sides of a plane; a side without any has empty bounds.
struct CutReference {
    Reference side[2];  ///< [0] at `position` and below, [1] at it and above
};

/// Cuts a reference whose box reaches to both sides of the plane. Its box is that of its triangle's
/// part in some cell; so are those of the parts, and together they lose no point of it. At least
/// one is not empty.
[[nodiscard]] CutReference cut_reference(MeshView mesh, const Reference& reference, int axis,
                                         float position);

}  // namespace packet
