#include "build/reinsertion.h"

#include "core/macros.h"
#include "core/views.h"

#include <algorithm>
#include <vector>

namespace packet {

namespace {

// The largest subtrees, a part of all, move by most of what all together would gain; each round
// starts from what the last one left. Measured: docs/experiments.md#quality-of-hierarchies.
constexpr int kRounds = 3;
constexpr std::size_t kOneOf = 50;
constexpr std::size_t kFewest = 256;
// Most searches visit the children of some twenty, and those of triangles in each other of a few
// hundred. Nothing proves that none visits all, so this ends them.
constexpr int kMostVisits = 1024;

constexpr std::uint32_t kNone = 0xFFFFFFFF;

struct Place {
    std::uint32_t parent;
    std::uint8_t height;
};

/// Takes `node` and its parent out, and puts them in above `target`.
struct Move {
    float gain = 0.0f;  ///< of area
    std::uint32_t node = kNone, target = kNone;
};

/// Half the surface of the box around two that are not empty.
float joint_area(const Bounds3f& a, const Bounds3f& b) {
    const glm::vec3 e = glm::max(a.upper, b.upper) - glm::min(a.lower, b.lower);
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

class Reinsertion {
public:
    Reinsertion(Hierarchy& hierarchy, const Parallel& parallel)
        : nodes_(hierarchy.nodes),
          parallel_(parallel),
          places_(hierarchy.nodes.size()),
          node_count_(survey(0, kNone, 0)) {}

    void run() {
        for (int round = 0; round < kRounds; ++round) {
            std::vector<Move> moves = find_moves();
            std::erase_if(moves, [](const Move& move) { return move.target == kNone; });
            std::ranges::stable_sort(moves, std::ranges::greater(), &Move::gain);
            for (const Move& move : moves) apply(move);
        }
    }

private:
    /// Subtrees at this depth are surveyed by tasks.
    static constexpr int kForkDepth = 6;

    /// Notes parents and heights of a node and those below; returns how many these are.
    std::size_t survey(std::uint32_t id, std::uint32_t parent, int depth) {
        if (depth == kForkDepth) parallel_.check();
        const BuildNode& node = nodes_[id];
        places_[id] = {parent, 0};
        if (node.is_leaf()) return 1;
        std::size_t first = 0, second = 0;
        if (depth < kForkDepth) {
            parallel_.both([&] { first = survey(node.first, id, depth + 1); },
                           [&] { second = survey(node.second, id, depth + 1); });
        } else {
            first = survey(node.first, id, depth + 1);
            second = survey(node.second, id, depth + 1);
        }
        places_[id].height = height_above(node);
        return 1 + first + second;
    }
    [[nodiscard]] std::uint8_t height_above(const BuildNode& inner) const {
        return static_cast<std::uint8_t>(
            1 + std::max(places_[inner.first].height, places_[inner.second].height));
    }

    [[nodiscard]] std::vector<Move> find_moves() const {
        constexpr std::size_t kGrain = 64;
        const std::vector<std::uint32_t> subtrees = largest_subtrees();
        std::vector<Move> moves(subtrees.size());
        parallel_.for_pieces(subtrees.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) moves[i] = find_move(subtrees[i]);
        });
        return moves;
    }
    /// In order of their boxes' areas, none of them the root or its child: no box is larger than
    /// its parent's.
    [[nodiscard]] std::vector<std::uint32_t> largest_subtrees() const {
        struct Entry {
            float area;
            std::uint32_t id;
        };
        const auto is_less = [](const Entry& a, const Entry& b) { return a.area < b.area; };
        std::vector<Entry> heap = {{0.0f, 0}};
        std::vector<std::uint32_t> out;
        const std::size_t most = std::max(node_count_ / kOneOf, kFewest);
        while (!heap.empty() && out.size() < most) {
            std::ranges::pop_heap(heap, is_less);
            const std::uint32_t id = heap.back().id;
            heap.pop_back();
            if (id != 0 && places_[id].parent != 0) out.push_back(id);
            if (nodes_[id].is_leaf()) continue;
            for (const std::uint32_t child : {nodes_[id].first, nodes_[id].second}) {
                heap.push_back({nodes_[child].bounds.half_area(), child});
                std::ranges::push_heap(heap, is_less);
            }
        }
        return out;
    }

    /// The best for a node that has a grandparent: all places are searched, those near it first,
    /// but for those below which what it would widen outweighs what it gains.
    [[nodiscard]] Move find_move(std::uint32_t id) const {
        // What would be gained if the node could be had for nothing below another, which grows.
        struct Entry {
            float gain;
            std::uint32_t id;
        };
        Entry stack[kMaxDepth + 2];  // a sibling for each node on the way down
        int size = 0, visits = 0;
        const Bounds3f& box = nodes_[id].bounds;
        const float area = box.half_area();
        Move best{.node = id};
        const auto visit = [&](float gain, std::uint32_t target) {
            const BuildNode& node = nodes_[target];
            const float gain_above = gain - joint_area(node.bounds, box);
            if (gain_above > best.gain) best = {gain_above, id, target};
            if (!node.is_leaf()) stack[size++] = {gain_above + node.bounds.half_area(), target};
        };
        const auto search = [&](float gain, std::uint32_t root) {
            if (gain - area > best.gain) visit(gain, root);
            while (size != 0) {
                const Entry entry = stack[--size];
                if (!(entry.gain - area > best.gain) || ++visits > kMostVisits) continue;
                visit(entry.gain, nodes_[entry.id].second);
                visit(entry.gain, nodes_[entry.id].first);
            }
        };
        // Without the node its parent goes, and what is above shrinks to the rest.
        std::uint32_t ancestor = places_[id].parent, sibling = sibling_of(id);
        Bounds3f rest = nodes_[sibling].bounds;
        float gain = nodes_[ancestor].bounds.half_area();
        search(gain, sibling);
        while (ancestor != 0) {
            sibling = sibling_of(ancestor);
            ancestor = places_[ancestor].parent;
            search(gain, sibling);
            rest.extend(nodes_[sibling].bounds);
            gain += nodes_[ancestor].bounds.half_area() - rest.half_area();
        }
        return best;
    }

    /// Unless other moves have left it nothing to gain, or it would lead too deep.
    void apply(const Move& move) {
        const std::uint32_t node = move.node, target = move.target;
        const std::uint32_t parent = places_[node].parent, sibling = sibling_of(node);
        if (parent == 0 || target == parent || target == sibling) return;
        int depth = 0;  // of the target
        for (std::uint32_t id = target; id != 0; id = places_[id].parent, ++depth) {
            if (id == node) return;
        }
        const int height = 1 + std::max(places_[node].height, places_[target].height);
        if (depth + height > kMaxDepth) return;
        const bool gains = put_next_to(node, target) < 0.0f;
        if (!gains) put_next_to(node, sibling);
    }
    /// Puts a node that has a grandparent, and its parent, above another. Returns how much area
    /// inner nodes gain.
    float put_next_to(std::uint32_t node, std::uint32_t target) {
        const std::uint32_t parent = places_[node].parent, sibling = sibling_of(node);
        const std::uint32_t from = places_[parent].parent;
        float change = 0.0f;
        replace_child(from, parent, sibling);
        refit(from, change);
        const std::uint32_t to = places_[target].parent;
        replace_child(to, target, parent);
        nodes_[parent].first = target;
        nodes_[parent].second = node;
        places_[target].parent = parent;
        update(parent, change);
        refit(to, change);
        return change;
    }
    void replace_child(std::uint32_t parent, std::uint32_t old_child, std::uint32_t new_child) {
        BuildNode& node = nodes_[parent];
        node.child(node.first == old_child ? 0 : 1) = new_child;
        places_[new_child].parent = parent;
    }
    /// Children of the node have changed.
    void refit(std::uint32_t id, float& change) {
        while (id != kNone && update(id, change)) id = places_[id].parent;
    }
    /// A node's box and height, from its children's; false if they are as they were.
    bool update(std::uint32_t id, float& change) {
        BuildNode& node = nodes_[id];
        Bounds3f box = nodes_[node.first].bounds;
        box.extend(nodes_[node.second].bounds);
        const std::uint8_t height = height_above(node);
        if (box == node.bounds && height == places_[id].height) return false;
        change += box.half_area() - node.bounds.half_area();
        node.bounds = box;
        places_[id].height = height;
        return true;
    }

    [[nodiscard]] std::uint32_t sibling_of(std::uint32_t id) const {
        const BuildNode& parent = nodes_[places_[id].parent];
        return parent.first == id ? parent.second : parent.first;
    }

    ScratchVector<BuildNode>& nodes_;
    const Parallel& parallel_;
    ScratchVector<Place> places_;
    std::size_t node_count_;
};

}  // namespace

void reinsert_subtrees(Hierarchy& hierarchy, const Parallel& parallel) {
    PACKET_ASSERT(hierarchy.is_wide_child.empty());
    if (hierarchy.ids.empty()) return;
    parallel.run([&] { Reinsertion(hierarchy, parallel).run(); });
}

}  // namespace packet
