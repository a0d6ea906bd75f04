// Subtrees that move: what they gain, and that nothing else changes.
#include "random.h"
#include "share.h"

#include "build/reinsertion.h"
#include "core/views.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

using namespace packet;
using packet::test::share_of;

namespace {

Bounds3f cube(const glm::vec3& center, float half_width) {
    return {center - half_width, center + half_width};
}

/// A hierarchy over boxes, a leaf each, as the calls say.
struct Maker {
    std::vector<Bounds3f> boxes;
    Hierarchy out;

    /// Leaves `begin` to `end` under `id`, halved by their order.
    void halve(std::uint32_t id, std::uint32_t begin, std::uint32_t end) {
        split(id, begin, begin + (end - begin + 1) / 2, end,
              [&](auto... range) { halve(range...); });
    }
    /// The same, peeled off one by one.
    void peel(std::uint32_t id, std::uint32_t begin, std::uint32_t end) {
        split(id, begin, begin + 1, end, [&](auto... range) { peel(range...); });
    }
    void two_beside_peeled(std::uint32_t count) {
        split(0, 0, 2, count, [&](std::uint32_t id, std::uint32_t begin, std::uint32_t end) {
            begin == 0 ? halve(id, begin, end) : peel(id, begin, end);
        });
    }

private:
    void split(std::uint32_t id, std::uint32_t begin, std::uint32_t middle, std::uint32_t end,
               const auto& below) {
        if (end - begin == 1) {
            out.nodes[id] = {boxes[begin], begin, 0, 1};
            out.ids.resize(std::max<std::size_t>(out.ids.size(), end));
            out.ids[begin] = begin;
            return;
        }
        const auto pair = static_cast<std::uint32_t>(out.nodes.size());
        out.nodes.resize(pair + 2);
        below(pair, begin, middle);
        below(pair + 1, middle, end);
        Bounds3f bounds = out.nodes[pair].bounds;
        bounds.extend(out.nodes[pair + 1].bounds);
        out.nodes[id] = {bounds, pair, pair + 1, 0};
    }
};

Hierarchy make_halved(std::vector<Bounds3f> boxes) {
    Maker maker{std::move(boxes), {}};
    maker.out.nodes.resize(1);
    maker.halve(0, 0, static_cast<std::uint32_t>(maker.boxes.size()));
    return std::move(maker.out);
}
/// Two leaves beside all others, which are peeled off one by one.
Hierarchy make_two_beside_peeled(std::vector<Bounds3f> boxes) {
    Maker maker{std::move(boxes), {}};
    maker.out.nodes.resize(1);
    maker.two_beside_peeled(static_cast<std::uint32_t>(maker.boxes.size()));
    return std::move(maker.out);
}

struct Measures {
    double inner_area = 0.0;
    int depth = 0;
};

/// Checks that nodes' boxes are those of their children, and that leaves hold each box once.
Measures measure(const Hierarchy& hierarchy, const std::vector<Bounds3f>& boxes) {
    Measures out;
    std::vector<int> times(boxes.size());
    std::vector<std::pair<std::uint32_t, int>> stack = {{0, 0}};
    while (!stack.empty()) {
        const auto [id, depth] = stack.back();
        stack.pop_back();
        REQUIRE(depth <= kMaxDepth);  // also where it goes round in circles
        const BuildNode& node = hierarchy.nodes.at(id);
        out.depth = std::max(out.depth, depth);
        if (node.is_leaf()) {
            REQUIRE(node.count == 1);
            const std::uint32_t box = hierarchy.ids.at(node.first);
            ++times.at(box);
            CHECK(node.bounds == boxes[box]);
            continue;
        }
        Bounds3f bounds = hierarchy.nodes.at(node.first).bounds;
        bounds.extend(hierarchy.nodes.at(node.second).bounds);
        CHECK(node.bounds == bounds);
        out.inner_area += static_cast<double>(node.bounds.half_area());
        stack.emplace_back(node.first, depth + 1);
        stack.emplace_back(node.second, depth + 1);
    }
    CHECK(std::ranges::count(times, 1) == static_cast<std::ptrdiff_t>(times.size()));
    return out;
}

/// Along a line, but for some runs of a subtree's length that are in each other's place.
std::vector<Bounds3f> shuffled_runs() {
    constexpr std::ptrdiff_t kRun = 256, kRuns = 128;
    std::vector<Bounds3f> out;
    for (int i = 0; i < kRun * kRuns; ++i) {
        out.push_back(cube({static_cast<float>(i), 0.0f, 0.0f}, 0.5f));
    }
    tools::Random random(7);
    const auto random_run = [&] {
        return out.begin() + kRun * static_cast<std::ptrdiff_t>(random.uniform() * kRuns);
    };
    for (int i = 0; i < 10; ++i) {
        const auto run = random_run();
        std::swap_ranges(run, run + kRun, random_run());
    }
    return out;
}

}  // namespace

TEST_CASE("boxes that are in each other's place go back") {
    std::vector<Bounds3f> boxes;
    for (int i = 0; i < 16; ++i) {
        const auto x = static_cast<float>(i % 8 + (i < 8 ? 0 : 1000));
        boxes.push_back(cube({x, 0.0f, 0.0f}, 0.5f));
    }
    const double want = measure(make_halved(boxes), boxes).inner_area;
    std::swap(boxes[2], boxes[11]);
    Hierarchy hierarchy = make_halved(boxes);
    CHECK(measure(hierarchy, boxes).inner_area > 5.0 * want);
    reinsert_subtrees(hierarchy, Parallel(1));
    CHECK(measure(hierarchy, boxes).inner_area < 1.05 * want);
}

TEST_CASE("large subtrees go back, the same by any number of threads") {
    const std::vector<Bounds3f> boxes = shuffled_runs();
    const Hierarchy before = make_halved(boxes);
    const double area = measure(before, boxes).inner_area;
    Hierarchy first = before;
    reinsert_subtrees(first, Parallel(1));
    CHECK(measure(first, boxes).inner_area < 0.5 * area);
    for (const int threads : {1, 2, 8}) {
        Hierarchy again = before;
        reinsert_subtrees(again, Parallel(threads));
        CHECK(std::memcmp(again.nodes.data(), first.nodes.data(),
                          first.nodes.size() * sizeof(BuildNode)) == 0);
    }
}

namespace {

/// By the slow way: the least area of inner nodes that moving one subtree, not of the root nor of
/// its children, next to another, not above it, comes to.
double best_by_one_move(const Hierarchy& hierarchy, const std::vector<Bounds3f>& boxes) {
    const auto count = static_cast<std::uint32_t>(hierarchy.nodes.size());
    std::vector<std::uint32_t> parent(count, count);
    for (std::uint32_t i = 0; i < count; ++i) {
        const BuildNode& node = hierarchy.nodes[i];
        if (node.is_leaf()) continue;
        parent[node.first] = parent[node.second] = i;
    }
    const auto is_above = [&](std::uint32_t above, std::uint32_t id) {
        while (id != count && id != above) id = parent[id];
        return id == above;
    };
    const auto refit = [](auto& self, Hierarchy& to, std::uint32_t id) -> Bounds3f {
        BuildNode& node = to.nodes[id];
        if (node.is_leaf()) return node.bounds;
        node.bounds = self(self, to, node.first);
        node.bounds.extend(self(self, to, node.second));
        return node.bounds;
    };
    double best = measure(hierarchy, boxes).inner_area;
    for (std::uint32_t id = 1; id < count; ++id) {
        if (parent[id] == 0) continue;
        for (std::uint32_t target = 1; target < count; ++target) {
            if (is_above(target, id) || is_above(id, target)) continue;
            Hierarchy moved = hierarchy;
            const std::uint32_t pair = parent[id];
            BuildNode& node = moved.nodes[pair];
            const std::uint32_t sibling = node.first == id ? node.second : node.first;
            if (target == sibling) continue;
            BuildNode& from = moved.nodes[parent[pair]];
            (from.first == pair ? from.first : from.second) = sibling;
            BuildNode& to = moved.nodes[parent[target]];
            (to.first == target ? to.first : to.second) = pair;
            node.first = target, node.second = id;
            refit(refit, moved, 0);
            best = std::min(best, measure(moved, boxes).inner_area);
        }
    }
    return best;
}

}  // namespace

TEST_CASE("in the end no single move gains anything") {
    tools::Random random(5);
    for (std::size_t repeat = 0; repeat < share_of(20); ++repeat) {
        std::vector<Bounds3f> boxes;
        for (int i = 0; i < 24; ++i) {
            boxes.push_back(cube(random.point(), 0.2f * random.uniform()));
        }
        Hierarchy hierarchy = make_halved(boxes);
        const double before = measure(hierarchy, boxes).inner_area;
        for (int i = 0; i < 10; ++i) reinsert_subtrees(hierarchy, Parallel(1));
        const double after = measure(hierarchy, boxes).inner_area;
        CHECK(after < before);
        CHECK(best_by_one_move(hierarchy, boxes) > 0.9999 * after);
    }
}

TEST_CASE("many moves at a time lead to trees") {
    tools::Random random(6);
    for (std::size_t repeat = 0; repeat < share_of(300, 30); ++repeat) {
        std::vector<Bounds3f> boxes;
        for (int i = 0; i < 100; ++i) {
            boxes.push_back(cube(random.point(), 0.2f * random.uniform()));
        }
        Hierarchy hierarchy = make_halved(boxes);
        const double before = measure(hierarchy, boxes).inner_area;
        reinsert_subtrees(hierarchy, Parallel(1));
        CHECK(measure(hierarchy, boxes).inner_area < 0.8 * before);
    }
}

TEST_CASE("nothing moves deeper than stacks are") {
    // Boxes in each other, of which the smallest holds one that lies elsewhere in the hierarchy.
    const auto depth_of = [](int nested) {
        std::vector<Bounds3f> boxes = {cube(glm::vec3(0.0f), 1e-6f), cube(glm::vec3(9.0f), 1.0f)};
        for (int i = 0; i < nested; ++i) {
            boxes.push_back(cube(glm::vec3(0.0f), std::pow(0.9f, static_cast<float>(i))));
        }
        Hierarchy hierarchy = make_two_beside_peeled(boxes);
        REQUIRE(measure(hierarchy, boxes).depth == nested);
        reinsert_subtrees(hierarchy, Parallel(1));
        return measure(hierarchy, boxes).depth;
    };
    CHECK(depth_of(kMaxDepth - 1) == kMaxDepth);  // it goes to the others
    CHECK(depth_of(kMaxDepth) == kMaxDepth);
}

TEST_CASE("where areas are infinite there are still trees") {
    tools::Random random(8);
    for (const float scale : {1e18f, 3e18f, 1e19f, 1e25f, 1e38f}) {
        CAPTURE(scale);
        std::vector<Bounds3f> boxes;
        for (int i = 0; i < 300; ++i) {
            boxes.push_back(cube(scale * (2.0f * random.point() - 1.0f), scale * random.uniform()));
        }
        Hierarchy hierarchy = make_halved(boxes);
        reinsert_subtrees(hierarchy, Parallel(1));
        measure(hierarchy, boxes);
    }
}

TEST_CASE("hierarchies too small to mend stay as they are") {
    for (const std::vector<Bounds3f>& boxes :
         {std::vector{cube({1.0f, 2.0f, 3.0f}, 1.0f)},
          std::vector{cube({1.0f, 2.0f, 3.0f}, 1.0f), cube({4.0f, 2.0f, 3.0f}, 1.0f)}}) {
        const Hierarchy before = make_halved(boxes);
        Hierarchy hierarchy = before;
        reinsert_subtrees(hierarchy, Parallel(1));
        CHECK(std::memcmp(before.nodes.data(), hierarchy.nodes.data(),
                          before.nodes.size() * sizeof(BuildNode)) == 0);
    }
    Hierarchy none;
    reinsert_subtrees(none, Parallel(1));
    CHECK(none.nodes.empty());
}
