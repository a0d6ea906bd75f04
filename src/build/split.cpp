#include "build/split.h"

#include "build/lane_bounds.h"

#include <algorithm>

namespace packet {

NodeBounds measure(ReferenceSpan refs, const Parallel& parallel) {
    return fold_references<NodeBounds>(
        refs, parallel,
        [](NodeBounds& out, ReferenceSpan piece) {
            LaneBounds bounds;
            for (const Reference& r : piece) bounds.extend(r);
            out = bounds.node_bounds();
        },
        [](NodeBounds& a, const NodeBounds& b) { a.extend(b); });
}

std::size_t halve(const NodeRange& node) {
    const ReferenceSpan refs = node.refs;
    const Bounds3f& centroids = node.bounds.centroids;
    const glm::vec3 extent = (centroids.empty() ? node.bounds.box : centroids).extent();
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

Halves divide(const NodeRange& node, std::size_t first, const NodeBounds& bounds0,
              const NodeBounds& bounds1) {
    const std::size_t count = node.refs.size(), second = count - first;
    const std::size_t room0 = node.room * first / count;
    // The first's room lies between them: as many of the second's move behind the others.
    const std::size_t moved = std::min(room0, second);
    Reference* const begin = node.refs.data() + first;
    std::copy_n(begin, moved, begin + room0 + second - moved);
    return {{{node.refs.first(first), bounds0, room0},
             {{begin + room0, second}, bounds1, node.room - room0}}};
}

Halves divide(const NodeRange& node, std::size_t first, const Parallel& parallel) {
    return divide(node, first, measure(node.refs.first(first), parallel),
                  measure(node.refs.subspan(first), parallel));
}

std::vector<Leaf> leaves_of(const Hierarchy& hierarchy) {
    std::vector<Leaf> out;
    std::vector<Leaf> stack = {{0, 0, 0}};
    while (!stack.empty()) {
        Leaf at = stack.back();
        stack.pop_back();
        const BuildNode& node = hierarchy.nodes[at.node];
        if (node.is_leaf()) {
            at.id = hierarchy.ids[node.first];
            out.push_back(at);
        } else {
            stack.push_back({node.second, 0, at.depth + 1});
            stack.push_back({node.first, 0, at.depth + 1});
        }
    }
    return out;
}

}  // namespace packet
