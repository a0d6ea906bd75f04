// The 8-wide form: every item reachable once, in boxes that contain its leaf, and never costlier
// than joining nothing.
#include "generate.h"

#include "build/tree.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace packet;

namespace {

struct Walked {
    std::vector<int> seen;  ///< by item: times it is in a leaf
    std::size_t nodes = 0;
    int children = 0;
    int depth = 0;
};

bool is_there(const WideNode& node, int child) {
    return node.plane[0][0][child] <= node.plane[1][0][child];
}

void check_box(const Tree& tree, const WideNode& node, int child, std::uint32_t item) {
    const TriangleBlock& block = tree.blocks.at(item / kBlockSize);
    for (const auto& corner : block.v) {
        for (int a = 0; a < 3; ++a) {
            const float x = corner[a][item % kBlockSize];
            CHECK(node.plane[0][a][child] <= x);
            CHECK(x <= node.plane[1][a][child]);
        }
    }
}

void walk(const Tree& tree, std::uint32_t id, int depth, Walked& out) {
    REQUIRE(id < tree.wide_nodes.size());
    REQUIRE(out.nodes++ < tree.wide_nodes.size());  // a cycle would pass this
    const WideNode& node = tree.wide_nodes[id];
    out.depth = std::max(out.depth, depth);
    for (int child = 0; child < kWideSize; ++child) {
        if (!is_there(node, child)) {
            CHECK(node.plane[0][0][child] == INFINITY);
            continue;
        }
        ++out.children;
        if (node.child[child].count == 0) {
            CHECK(node.child[child].link > id);
            walk(tree, node.child[child].link, depth + 1, out);
            continue;
        }
        for (std::uint32_t i = 0; i < node.child[child].count; ++i) {
            ++out.seen.at(node.child[child].link + i);
            check_box(tree, node, child, node.child[child].link + i);
        }
        const bool one_block = node.child[child].link / kBlockSize ==
                               (node.child[child].link + node.child[child].count - 1) / kBlockSize;
        CHECK((one_block || node.child[child].count > kBlockSize));
    }
}

}  // namespace

TEST_CASE("the 8-wide form holds every triangle once, in boxes that contain it") {
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        for (const std::size_t count : {1u, 2u, 9u, 1000u, 30000u}) {
            CAPTURE(kind.name);
            CAPTURE(count);
            const Tree tree = build_tree(kind.make(count, 1).view(), {});
            Walked out;
            out.seen.assign(tree.blocks.size() * kBlockSize, 0);
            walk(tree, 0, 0, out);
            CHECK(out.nodes == tree.wide_nodes.size());
            CHECK(out.depth <= tree.stats.depth);
            for (std::size_t i = 0; i < out.seen.size(); ++i) {
                const bool filled = tree.blocks[i / kBlockSize].prim_id[i % kBlockSize] >= 0;
                REQUIRE(out.seen[i] == (filled ? 1 : 0));
            }
        }
    }
}

TEST_CASE("wide nodes are well filled and their leaves share blocks") {
    const Tree tree = build_tree(tools::make_city(50000, 1).view(), {});
    Walked out;
    out.seen.assign(tree.blocks.size() * kBlockSize, 0);
    walk(tree, 0, 0, out);
    CHECK(out.children > 4 * static_cast<int>(out.nodes));
    CHECK(tree.blocks.size() * kBlockSize < 2 * 50000);
}
