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

namespace {

/// Room goes where rays will come by and find triangles that are worth cutting: by the number of
/// references, times the area of their box.
std::size_t share_of_first(std::size_t room, const std::size_t (&count)[2],
                           const NodeBounds (&bounds)[2]) {
    if (room == 0) return 0;
    double need[2];
    for (int i = 0; i < 2; ++i) {
        need[i] = static_cast<double>(count[i]) * static_cast<double>(bounds[i].box.half_area());
    }
    const double all = need[0] + need[1];
    const double part =
        all > 0.0 ? need[0] / all
                  : static_cast<double>(count[0]) / static_cast<double>(count[0] + count[1]);
    return std::min(room, static_cast<std::size_t>(part * static_cast<double>(room)));
}

}  // namespace

Halves divide(const NodeRange& node, std::size_t first, const NodeBounds& bounds0,
              const NodeBounds& bounds1) {
    const std::size_t second = node.refs.size() - first;
    const std::size_t room0 = share_of_first(node.room, {first, second}, {bounds0, bounds1});
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
