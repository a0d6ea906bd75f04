#include "build/clip.h"

#include "build/triangle_clipper.h"
#include "core/macros.h"

namespace packet {

Bounds3f clip_triangle(const glm::vec3 (&corners)[3], const Bounds3f& box) {
    TriangleClipper clipper(corners);
    clipper.cut_to(box);
    return clipper.bounds_in(box);
}

static Reference with_bounds(const Reference& reference, const Bounds3f& box) {
    return {box.lower, reference.id, box.upper};
}

CutReference cut_reference(MeshView mesh, const Reference& reference, int axis, float position) {
    PACKET_ASSERT(reference.lower[axis] < position && position < reference.upper[axis]);
    const glm::uvec3 triangle = mesh.triangles[reference.id];
    const CutBounds parts = cut_bounds(
        {mesh.positions[triangle.x], mesh.positions[triangle.y], mesh.positions[triangle.z]},
        reference.bounds(), axis, position);
    return {{with_bounds(reference, parts.side[0]), with_bounds(reference, parts.side[1])}};
}

}  // namespace packet
