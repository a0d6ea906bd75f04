#include "build/split.h"

#include <algorithm>

namespace packet {

NodeBounds measure(ReferenceSpan refs, const Parallel& parallel) {
    return fold_references<NodeBounds>(
        refs, parallel,
        [](NodeBounds& out, ReferenceSpan piece) {
            for (const Reference& r : piece) out.extend(r);
        },
        [](NodeBounds& a, const NodeBounds& b) { a.extend(b); });
}

std::size_t halve(ReferenceSpan refs, const Bounds3f& centroids) {
    const glm::vec3 extent = centroids.extent();
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0
                     : extent.y >= extent.z                       ? 1
                                                                  : 2;
    const std::size_t half = refs.size() / 2;
    std::nth_element(refs.begin(), refs.begin() + static_cast<std::ptrdiff_t>(half), refs.end(),
                     [axis](const Reference& a, const Reference& b) {
                         const float ca = a.lower[axis] + a.upper[axis];
                         const float cb = b.lower[axis] + b.upper[axis];
                         return ca < cb || (ca == cb && a.id < b.id);
                     });
    return half;
}

}  // namespace packet
