#include "schedule/treelet_order.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace packet {

std::vector<std::uint32_t> treelet_order(const TreeView& tree, const glm::vec3& direction) {
    const std::uint32_t count = tree.treelet_count;
    std::vector<float> distance(count);
    std::vector<std::uint32_t> near_first(count), farthest(count, count), next(count, count);
    for (std::uint32_t t = 0; t < count; ++t) {
        const float* centre = tree.treelet_roots[t].centre;
        distance[t] = centre[0] * direction.x + centre[1] * direction.y + centre[2] * direction.z;
    }
    std::iota(near_first.begin(), near_first.end(), 0u);
    std::stable_sort(near_first.begin(), near_first.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return distance[a] < distance[b]; });
    // A list of those below each, the farthest first.
    for (const std::uint32_t t : near_first) {
        if (t == 0) continue;
        const std::uint32_t parent = tree.treelet_roots[t].parent;
        next[t] = std::exchange(farthest[parent], t);
    }
    std::vector<std::uint32_t> out, pending = {0};
    while (!pending.empty()) {
        const std::uint32_t treelet = pending.back();
        pending.pop_back();
        out.push_back(treelet);
        for (std::uint32_t t = farthest[treelet]; t != count; t = next[t]) pending.push_back(t);
    }
    return out;
}

}  // namespace packet
