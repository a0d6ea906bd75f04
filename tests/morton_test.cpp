// The Morton builder's parts against plain statements of what they compute.
#include "generate.h"
#include "random.h"

#include "build/bvh_morton.h"
#include "build/radix_tree.h"
#include "build/tree.h"
#include "core/morton.h"
#include "schedule/radix_sort.h"

#include <packet/error.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <vector>

using namespace packet;

namespace {

/// Bit i of each number to bit 3i of its place, one by one.
template <class Code>
Code interleave_bitwise(Code x, Code y, Code z) {
    Code out = 0;
    for (int bit = 0; bit < kMortonBits<Code> / 3; ++bit) {
        out |= (x >> bit & 1) << (3 * bit + 2);
        out |= (y >> bit & 1) << (3 * bit + 1);
        out |= (z >> bit & 1) << (3 * bit);
    }
    return out;
}

template <class Code>
std::vector<MortonItem<Code>> items_of(std::vector<Code> codes) {
    std::sort(codes.begin(), codes.end());
    std::vector<MortonItem<Code>> out;
    for (const Code code : codes) out.push_back({code, static_cast<std::uint32_t>(out.size())});
    return out;
}

/// Random codes in [0, 2^bits).
template <class Code>
std::vector<Code> random_codes(std::size_t count, int bits, std::uint64_t seed) {
    tools::Random random(seed);
    std::vector<Code> out(count);
    for (Code& code : out) code = static_cast<Code>(random.next() >> (64 - bits));
    return out;
}

/// The tree from the top down, one node after another: the reference for radix_node. A node's range
/// ends where its highest bit that is not the same for all turns from 0 to 1, found by looking at
/// one item after the other; ranges of equal codes are split by the bits of the position.
template <class Code>
class TopDown {
public:
    TopDown(std::span<const MortonItem<Code>> items, int dropped_bits) {
        for (std::size_t i = 0; i < items.size(); ++i) {
            keys_.push_back({items[i].code >> dropped_bits, static_cast<Code>(i)});
        }
        nodes_.resize(items.size() - 1);
        split(0, 0, static_cast<std::uint32_t>(items.size() - 1), 0);
    }
    [[nodiscard]] const std::vector<RadixNode>& nodes() const { return nodes_; }
    [[nodiscard]] int depth() const { return depth_; }

private:
    struct Key {
        Code code, position;
    };

    void split(std::uint32_t node, std::uint32_t first, std::uint32_t last, int depth) {
        depth_ = std::max(depth_, depth);
        if (first == last) return;
        const bool by_code = keys_[first].code != keys_[last].code;
        const auto value = [&](std::uint32_t i) {
            return by_code ? keys_[i].code : keys_[i].position;
        };
        const Code bit = std::bit_floor(static_cast<Code>(value(first) ^ value(last)));
        std::uint32_t middle = first;
        while ((value(middle + 1) & bit) == 0) ++middle;
        nodes_[node] = {first, last, middle};
        split(middle, first, middle, depth + 1);
        split(middle + 1, middle + 1, last, depth + 1);
    }

    std::vector<Key> keys_;
    std::vector<RadixNode> nodes_;
    int depth_ = 0;
};

template <class Code>
void check_same_tree(const std::vector<Code>& codes, int dropped_bits = 0) {
    const std::vector<MortonItem<Code>> items = items_of(codes);
    const TopDown<Code> want(items, dropped_bits);
    const RadixKeys<Code> keys(items, dropped_bits);
    std::size_t different = 0;
    for (std::uint32_t i = 0; i + 1 < items.size(); ++i) {
        different += radix_node(keys, i) != want.nodes()[i];
    }
    CHECK(different == 0);
}

/// Codes whose tree has a path through every one of its bits: 0, 1, 2, 4 and so on; and `copies`
/// more of the deepest, so that the path goes on through the bits of their positions.
std::vector<std::uint64_t> deep_codes(std::size_t copies) {
    std::vector<std::uint64_t> out(copies, 0);
    for (int bit = 0; bit < 63; ++bit) out.push_back(std::uint64_t{1} << bit);
    return out;
}

/// A reference whose doubled centroid is 2 * point.
Reference point_reference(const glm::vec3& point, std::size_t id) {
    return {point, static_cast<std::uint32_t>(id), point};
}

}  // namespace

TEST_CASE("Morton codes are the bits of three numbers in turn") {
    tools::Random random(1);
    for (int i = 0; i < 10000; ++i) {
        const std::uint64_t x = random.next(), y = random.next(), z = random.next();
        CHECK(interleave(x, y, z) == interleave_bitwise(x, y, z));
        const auto low = [](std::uint64_t n) { return static_cast<std::uint32_t>(n); };
        CHECK(interleave(low(x), low(y), low(z)) == interleave_bitwise(low(x), low(y), low(z)));
    }
    CHECK(interleave(1023u, 1023u, 1023u) == (1u << 30) - 1);
    const std::uint64_t most = (1u << 21) - 1;
    CHECK(interleave(most, most, most) == (std::uint64_t{1} << 63) - 1);
}

TEST_CASE("a Morton grid's cells cover its box, ends included") {
    const MortonGrid<std::uint64_t> grid({{-1, 2, 3}, {3, 4, 5}});
    CHECK(grid.code({-1, 2, 3}) == 0);
    const std::uint64_t most = (1u << 21) - 1, half = (1u << 20);
    CHECK(grid.code({3, 2, 3}) == interleave(most, std::uint64_t{0}, std::uint64_t{0}));
    CHECK(grid.code({-1, 4, 5}) == interleave(std::uint64_t{0}, half, half));
    for (const float size : {0.0f, 1e-44f}) {  // nothing to tell apart: one cell
        const MortonGrid<std::uint32_t> point({{7, 7, 7}, {7 + size, 7 + size, 7 + size}});
        CHECK(point.code({7, 7, 7}) == 0);
    }
}

TEST_CASE("the radix sort is std::stable_sort, for any size, key and number of threads") {
    for (const std::size_t count : {0u, 1u, 2u, 3u, 255u, 1000u, 65535u, 65536u, 65537u, 100000u}) {
        for (const int bits : {1, 9, 30, 63}) {  // few bits: many duplicates
            std::vector<MortonItem<std::uint64_t>> items;
            for (const std::uint64_t code : random_codes<std::uint64_t>(count, bits, count)) {
                items.push_back({code, static_cast<std::uint32_t>(items.size())});
            }
            auto want = items;
            std::stable_sort(want.begin(), want.end(),
                             [](const auto& a, const auto& b) { return a.code < b.code; });
            for (const int threads : {1, 2, 7}) {
                CAPTURE(count);
                CAPTURE(bits);
                CAPTURE(threads);
                auto got = items, scratch = items;
                const auto sorted = radix_sort<MortonItem<std::uint64_t>>(
                    got, scratch, 63, Parallel(threads),
                    [](const auto& item) { return item.code; });
                REQUIRE(sorted.size() == count);
                CHECK(std::equal(sorted.begin(), sorted.end(), want.begin(),
                                 [](const auto& a, const auto& b) {
                                     return a.code == b.code && a.index == b.index;
                                 }));
            }
        }
    }
}

TEST_CASE("nodes built each by itself are the tree built from the top down") {
    for (const std::size_t count : {2u, 3u, 4u, 5u, 64u, 65u, 1000u, 20000u}) {
        for (const int bits : {1, 2, 7, 15, 30}) {
            CAPTURE(count);
            CAPTURE(bits);
            check_same_tree(random_codes<std::uint32_t>(count, bits, count));
            check_same_tree(random_codes<std::uint64_t>(count, 2 * bits, count));
            check_same_tree(random_codes<std::uint64_t>(count, 2 * bits, count), bits);
        }
    }
    check_same_tree(deep_codes(1));
    check_same_tree(deep_codes(1000));
}

TEST_CASE("equal codes are halved") {
    for (const std::size_t count : {2u, 3u, 1000u, 1024u}) {
        const std::vector<std::uint32_t> codes(count, 12345);
        check_same_tree(codes);
        const TopDown<std::uint32_t> tree(items_of(codes), 0);
        CHECK(tree.depth() == std::bit_width(count - 1));
    }
}

TEST_CASE("bits that are dropped keep any tree within the depth that is walked") {
    for (const std::size_t copies : {1u, 2u, 3u, 1000u, 50000u}) {
        const auto codes = deep_codes(copies);
        const auto items = items_of(codes);
        const int dropped = dropped_bits_for_depth(63, codes.size());
        CHECK(TopDown<std::uint64_t>(items, 0).depth() > 62);
        CHECK(TopDown<std::uint64_t>(items, dropped).depth() <= kMaxDepth);
        CHECK(63 - dropped + static_cast<int>(std::bit_width(codes.size() - 1)) <= kMaxDepth);
        check_same_tree(codes, dropped);
    }
    CHECK(dropped_bits_for_depth(30, std::size_t{1} << 31) == 0);
    CHECK(dropped_bits_for_depth(63, std::size_t{1} << 31) == 30);
}

TEST_CASE("a builder whose codes would lead too deep stays within kMaxDepth") {
    // Points whose codes are powers of 2, and thousands more at the origin.
    ScratchVector<Reference> references;
    for (int i = 0; i < 3000; ++i) references.push_back(point_reference({0, 0, 0}, 0));
    for (int bit = 0; bit < 21; ++bit) {
        for (int axis = 0; axis < 3; ++axis) {
            glm::vec3 point(0.0f);
            point[axis] = static_cast<float>(1 << bit);
            references.push_back(point_reference(point, 0));
        }
    }
    references.push_back(point_reference(glm::vec3(1 << 21), 0));
    for (std::uint32_t i = 0; i < references.size(); ++i) references[i].id = i;
    BuildOptions options;
    options.max_leaf_size = 1;
    options.keep_binary_nodes = true;
    for (const int bits : {30, 63}) {
        options.morton_bits = bits;
        const Parallel parallel(2);
        const Hierarchy hierarchy = build_bvh_morton(references, options, parallel);
        const Tree tree = make_tree(hierarchy, options, parallel);
        CHECK(tree.stats.leaf_count == references.size());
        CHECK(tree.stats.depth > 40);
        CHECK(tree.stats.depth <= kMaxDepth);
    }
}

TEST_CASE("Morton trees of few triangles") {
    BuildOptions options;
    options.accel = AccelKind::kBvhMorton;
    options.max_leaf_size = 1;
    options.keep_binary_nodes = true;
    for (const std::size_t count : {1u, 2u, 3u}) {
        const Tree tree = build_tree(tools::make_soup(count, 4).view(), options);
        CHECK(tree.stats.leaf_count == count);
        CHECK(tree.nodes.size() == 2 * count - 1);
    }
}

TEST_CASE("Morton trees have leaves where those are cheaper, whatever the bits of a code") {
    const TriangleMesh mesh = tools::make_city(20000, 5);
    for (const int bits : {0, 30, 63}) {
        BuildOptions options;
        options.accel = AccelKind::kBvhMorton;
        options.morton_bits = bits;
        const BuildStats collapsed = build_tree(mesh.view(), options).stats;
        options.max_leaf_size = 1;
        const BuildStats single = build_tree(mesh.view(), options).stats;
        CHECK(single.leaf_count == mesh.triangles.size() - single.skipped.total());
        CHECK(collapsed.leaf_count < single.leaf_count);
        CHECK(collapsed.sah_cost < single.sah_cost);
    }
    BuildOptions bad;
    bad.morton_bits = 31;
    CHECK_THROWS_WITH_AS((void)build_tree(mesh.view(), bad),
                         "BuildOptions::morton_bits must be 0, 30 or 63", Error);
}
