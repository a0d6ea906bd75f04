// What is wrong with a tree is found, and named.
#include "generate.h"

#include "build/validate_tree.h"

#include <packet/error.h>

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <string>

using namespace packet;

namespace {

constexpr AccelKind kKinds[] = {AccelKind::kBvh, AccelKind::kOctree};

BuildOptions options_of(AccelKind kind) {
    BuildOptions options;
    options.accel = kind;
    options.max_leaf_size = 3;  // so that blocks have lanes without a triangle
    options.treelet_bytes = 8000;
    options.keep_binary_nodes = true;
    return options;
}

/// The first index from `begin` of something in the list that `test` holds of.
template <class List, class Test>
std::size_t find(const List& list, Test test, std::size_t begin = 0) {
    while (begin < list.size() && !test(list[begin])) ++begin;
    REQUIRE(begin < list.size());
    return begin;
}

struct Fault {
    std::string message;  ///< how the complaint goes on after "tree: "
    std::function<void(Tree&)> make;
};

/// A child of a wide node.
struct Child {
    std::size_t node;
    int lane;

    [[nodiscard]] float& plane(Tree& t, int side, int axis) const {
        return t.wide_nodes[node].plane[side][axis][lane];
    }
    [[nodiscard]] std::uint32_t& link(Tree& t) const { return t.wide_nodes[node].child[lane].link; }
    [[nodiscard]] std::uint32_t& count(Tree& t) const {
        return t.wide_nodes[node].child[lane].count;
    }
};

/// Places in a sound tree to spoil.
struct Places {
    std::size_t inner, leaf, used;
    std::size_t unused = 0;
    Child wide_inner, wide_leaf, wide_absent;

    explicit Places(const Tree& tree)
        : inner(find(
              tree.nodes, [](const Node& n) { return !n.is_leaf(); }, 2)),
          leaf(find(tree.nodes, [](const Node& n) { return n.count > 1; })),
          used(tree.nodes[leaf].link),
          wide_inner(find_child(tree, [](float width, auto n) { return width >= 0 && n == 0; })),
          wide_leaf(find_child(tree, [](float width, auto n) { return width >= 0 && n > 1; })),
          wide_absent(find_child(tree, [](float width, auto) { return width < 0; })) {
        while (tree.blocks[unused / kBlockSize].prim_id[unused % kBlockSize] >= 0) ++unused;
    }

private:
    template <class Test>
    static Child find_child(const Tree& tree, Test test) {
        int lane = 0;
        const std::size_t node = find(tree.wide_nodes, [&](const WideNode& n) {
            for (lane = 0; lane < kWideSize; ++lane) {
                const float width = n.plane[1][0][lane] - n.plane[0][0][lane];
                if (test(width, n.child[lane].count)) return true;
            }
            return false;
        });
        return {node, lane};
    }
};

std::string named(const char* what, std::size_t index, const char* rule) {
    return std::string(what) + " " + std::to_string(index) + ": " + rule;
}

TriangleBlock& block(Tree& tree, std::size_t item) { return tree.blocks[item / kBlockSize]; }

std::vector<Fault> faults_of_nodes(const Tree& sound, const Places& at) {
    const std::size_t inner = at.inner, leaf = at.leaf, last = sound.nodes.size() - 1;
    const Node& node = sound.nodes[inner];
    const std::string link = named("node", inner, "its second child is not where");
    const std::string box = named("node", inner + 1, "its box is not in its parent's");
    std::vector<Fault> out = {
        {link, [=](Tree& t) { ++t.nodes[inner].link; }},
        {link, [=](Tree& t) { t.nodes[inner].link = 0xFFFFFFFF; }},
        {box, [=](Tree& t) { t.nodes[inner + 1].plane[0][1] = -1e9f; }},
        {named("node", node.link, "its box is not in"),
         [=, second = node.link](Tree& t) { t.nodes[second].plane[1][2] = 1e9f; }},
        {named("node", leaf, "refers to items that are not there"),
         [=](Tree& t) { t.nodes[leaf].link = 0xFFFFFFF0; }},
        {named("node", leaf, "refers to items that are not there"),
         [=](Tree& t) { t.nodes[leaf].count = 0xFFFFFFF0; }},
        {"wide node", [=](Tree& t) { --t.nodes[leaf].count; }},
        {"", [=](Tree& t) { ++t.nodes[leaf].count; }},
        {"", [=](Tree& t) { t.nodes[leaf].count = 0; }},
        {"", [=](Tree& t) { t.nodes[leaf].link += 1; }},
        {"node", [=](Tree& t) { t.nodes.pop_back(), t.nodes.back() = t.nodes[leaf]; }},
        {named("node", last + 1, "has no parent"),
         [](Tree& t) { t.nodes.push_back(t.nodes.back()); }},
        {named("node", 0, "its box is not the tree's"), [](Tree& t) { t.bounds.lower.x -= 1.0f; }},
        {named("node", 0, "the statistics"), [](Tree& t) { ++t.stats.depth; }},
        {named("node", 0, "the statistics"), [](Tree& t) { ++t.stats.leaf_count; }},
        {named("node", 0, "the statistics"), [](Tree& t) { ++t.stats.node_count; }},
    };
    for (int side = 0; side < 2; ++side) {
        for (int a = 0; a < 3; ++a) {
            const float outward = side == 0 ? -1.0f : 1.0f;
            out.push_back({named("node", leaf, "its box"),
                           [=](Tree& t) { t.nodes[leaf].plane[side][a] = std::nanf(""); }});
            // So far that it leaves the parent's box, or no longer holds what it should.
            out.push_back(
                {"node", [=](Tree& t) { t.nodes[leaf].plane[side][a] += 1000.0f * outward; }});
            out.push_back({"node", [=](Tree& t) {
                               float(&plane)[2][3] = t.nodes[leaf].plane;
                               plane[side][a] -= 1000.0f * outward;
                           }});
        }
    }
    return out;
}

std::vector<Fault> faults_of_wide_nodes(const Tree& sound, const Places& at) {
    const Child inner = at.wide_inner, leaf = at.wide_leaf, absent = at.wide_absent;
    const std::size_t below = sound.wide_nodes[inner.node].child[inner.lane].link;
    const auto own = static_cast<std::uint32_t>(inner.node);
    const std::string no_child = named("wide node", inner.node, "a child is not there");
    const std::string no_items = named("wide node", leaf.node, "refers to items");
    std::vector<Fault> out = {
        {no_child, [=](Tree& t) { inner.link(t) = own; }},
        {no_child, [=](Tree& t) { inner.link(t) = 0xFFFFFFFF; }},
        {"wide node", [=](Tree& t) { ++inner.link(t); }},
        {"wide node", [=](Tree& t) { inner.count(t) = 1; }},
        {"", [=](Tree& t) { ++leaf.link(t); }},
        {no_items, [=](Tree& t) { leaf.link(t) = 0xFFFFFFF0; }},
        {no_items, [=](Tree& t) { leaf.count(t) = 0xFFFFFFF0; }},
        {"", [=](Tree& t) { ++leaf.count(t); }},
        {"", [=](Tree& t) { --leaf.count(t); }},
        {"wide node", [=](Tree& t) { absent.link(t) = 1; }},
        {"wide node", [=](Tree& t) { absent.count(t) = 2; }},
        {named("wide node", sound.wide_nodes.size(), "has no parent before it"),
         [](Tree& t) { t.wide_nodes.push_back(t.wide_nodes.back()); }},
        {"wide node 0", [](Tree& t) { t.wide_nodes.clear(); }},
    };
    for (int side = 0; side < 2; ++side) {
        for (int a = 0; a < 3; ++a) {
            const auto set = [=](Child child, float x) {
                return [=](Tree& t) { child.plane(t, side, a) = x; };
            };
            const float inward = side == 0 ? 1e9f : -1e9f;
            out.push_back(
                {named("wide node", below, "a child's box is not in its own"), set(inner, inward)});
            out.push_back({"wide node", set(leaf, inward)});
            out.push_back({"wide node", set(leaf, std::nanf(""))});
            out.push_back({"wide node", set(absent, 0.0f)});
        }
    }
    return out;
}

void swap_items(Tree& tree, std::size_t i, std::size_t j) {
    TriangleBlock &a = block(tree, i), &b = block(tree, j);
    const std::size_t la = i % kBlockSize, lb = j % kBlockSize;
    std::swap(a.prim_id[la], b.prim_id[lb]);
    for (int k = 0; k < 9; ++k) std::swap(a.v[k / 3][k % 3][la], b.v[k / 3][k % 3][lb]);
}

std::vector<Fault> faults_of_items(const Tree& sound, const Places& at) {
    const std::size_t used = at.used, unused = at.unused;
    const std::size_t other = sound.nodes.back().link;  // a leaf at the other end of the scene
    const std::size_t lane = used % kBlockSize, empty = unused % kBlockSize;
    std::vector<Fault> out = {
        {named("item", used, "its prim_id is not one of the mesh"),
         [=](Tree& t) { block(t, used).prim_id[lane] = -1; }},
        {named("item", used, "its prim_id is not one of the mesh"),
         [=](Tree& t) { block(t, used).prim_id[lane] = 1 << 30; }},
        {"", [=](Tree& t) { block(t, used).prim_id[lane] ^= 1; }},
        {named("item", unused, "is in no leaf"),
         [=](Tree& t) { block(t, unused).prim_id[empty] = 0; }},
        {"", [](Tree& t) { t.blocks.resize(t.blocks.size() - 1); }},
        {named("node", at.leaf, "its box does not"), [=](Tree& t) { swap_items(t, used, other); }},
    };
    for (int c = 0; c < 3; ++c) {
        for (int a = 0; a < 3; ++a) {
            out.push_back({named("item", used, "its corners are not its triangle's"),
                           [=](Tree& t) { block(t, used).v[c][a][lane] += 1.0f; }});
            out.push_back({named("item", unused, "is empty but could be hit"),
                           [=](Tree& t) { block(t, unused).v[c][a][empty] = 0.0f; }});
        }
    }
    return out;
}

std::vector<Fault> faults_of_treelets(const Tree& sound) {
    const std::size_t longest = find(
        sound.treelets.begin,
        [&, i = 0u](std::uint32_t begin) mutable { return sound.treelets.begin[++i] - begin > 1; });
    const std::uint32_t first = sound.treelets.begin[longest];
    return {
        {named("treelet", 0, "they are not all"), [](Tree& t) { ++t.treelets.begin.front(); }},
        {named("treelet", 0, "they are not all"), [](Tree& t) { --t.treelets.begin.back(); }},
        {named("treelet", 0, "they are not all"), [](Tree& t) { t.treelets.of_node.pop_back(); }},
        {named("treelet", longest, "has no nodes"),
         [=](Tree& t) { t.treelets.begin[longest + 1] = first; }},
        {named("treelet", 0, "a node of it is noted as another's"),
         [](Tree& t) { t.treelets.of_node[0] ^= 1; }},
        {"treelet", [=](Tree& t) { t.treelets.of_node[first + 1] ^= 1; }},
        {"treelet", [=](Tree& t) { --t.treelets.begin[longest + 1]; }},
        {"treelet",
         [=](Tree& t) {
             --t.treelets.begin[longest + 1];
             t.treelets.of_node[t.treelets.begin[longest + 1]] += 1;
         }},
        {named("treelet", 0, "other numbers"), [](Tree& t) { ++t.treelets.most_exits; }},
        {named("treelet", 0, "the statistics"), [](Tree& t) { ++t.stats.treelets.count; }},
        {named("treelet", 0, "the statistics"), [](Tree& t) { ++t.stats.treelets.cut_edges; }},
    };
}

std::string complaint(const Tree& tree, MeshView mesh, AccelKind kind) {
    try {
        validate(tree, mesh, kind);
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("every structure over every kind of scene is as it should be") {
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        for (const std::size_t count : {1u, 2u, 9u, 100u, 5000u}) {
            for (const AccelName& accel : accel_names()) {
                const TriangleMesh mesh = kind.make(count, 4);
                for (const int leaf_size : {1, 8, 64}) {
                    BuildOptions options;
                    options.accel = accel.kind;
                    options.max_leaf_size = leaf_size;
                    options.treelet_bytes = 3000;
                    options.keep_binary_nodes = leaf_size != 8;
                    const Tree tree = build_tree(mesh.view(), options);
                    CHECK(complaint(tree, mesh.view(), accel.kind) == "");
                }
            }
        }
    }
}

TEST_CASE("whatever in a tree is spoilt is found and named") {
    const TriangleMesh mesh = tools::make_hairball(600, 3);
    for (const AccelKind kind : kKinds) {
        CAPTURE(to_string(kind));
        const Tree sound = build_tree(mesh.view(), options_of(kind));
        REQUIRE(complaint(sound, mesh.view(), kind) == "");
        const Places at(sound);
        int number = 0;
        for (const auto& faults : {faults_of_nodes(sound, at), faults_of_wide_nodes(sound, at),
                                   faults_of_items(sound, at), faults_of_treelets(sound)}) {
            for (const Fault& fault : faults) {
                ++number;
                CAPTURE(number);
                Tree tree = sound;
                fault.make(tree);
                const std::string got = complaint(tree, mesh.view(), kind);
                CAPTURE(got);
                CHECK(got.starts_with("tree: " + fault.message));
            }
        }
    }
}

TEST_CASE("triangles that a tree lacks, repeats or should not have are found") {
    TriangleMesh mesh = tools::make_soup(50, 1);
    const Tree tree = build_tree(mesh.view(), {});
    TriangleMesh more = mesh;
    more.triangles.push_back(more.triangles[7]);
    CHECK(complaint(tree, more.view(), AccelKind::kBvh) == "tree: triangle 50: is in no leaf");
    TriangleMesh flat = mesh;
    flat.positions[flat.triangles[7].x] = flat.positions[flat.triangles[7].y];
    CHECK(complaint(build_tree(flat.view(), {}), flat.view(), AccelKind::kBvh) == "");
    CHECK(complaint(tree, flat.view(), AccelKind::kBvh) != "");

    const TriangleMesh hairs = tools::make_hairball(600, 3);
    const Tree parts = build_tree(hairs.view(), options_of(AccelKind::kKdSah));
    CHECK(complaint(parts, hairs.view(), AccelKind::kKdSah) == "");
    CHECK(complaint(parts, hairs.view(), AccelKind::kBvh) != "");
}
