// Every step is one thread an item: the box of the centroids by reduction, codes, the sort, the
// nodes of the radix tree each from the codes around it, and their boxes from the leaves up, where
// of a node's two children the thread that comes last goes on with the node.
//
// Karras. Maximizing parallelism in the construction of BVHs, octrees, and k-d trees. HPG 2012.
#include "morton_build.h"

#include "build/bvh_morton.h"
#include "build/radix_hierarchy.h"
#include "core/morton.h"
#include "item_launch.h"
#include "ordered_bounds.h"
#include "radix_sort.h"

namespace packet::cuda {

namespace {

/// The box of doubled centroids. Threads beyond the end repeat the last reference.
__global__ void measure_centroids(const Reference* references, std::uint32_t count,
                                  OrderedBounds* out) {
    const unsigned i = thread_in_grid();
    const Reference& r = references[i < count ? i : count - 1];
    const glm::vec3 centroid = r.lower + r.upper;
    extend_by_warp(*out, OrderedBounds::from({centroid, centroid}));
}

template <class Code>
__global__ void fill_codes(const Reference* references, std::uint32_t count, MortonGrid<Code> grid,
                           Code* codes, std::uint32_t* indices) {
    const unsigned i = thread_in_grid();
    if (i >= count) return;
    codes[i] = grid.code(references[i].lower + references[i].upper);
    indices[i] = i;
}

__global__ void gather_references(const Reference* references, const std::uint32_t* indices,
                                  std::uint32_t count, Reference* sorted) {
    const unsigned i = thread_in_grid();
    if (i < count) sorted[i] = references[indices[i]];
}

/// As RadixKeys, of codes by themselves.
template <class Code>
struct DeviceKeys {
    const Code* codes;
    std::int64_t size;
    int dropped_bits;

    PACKET_DEVICE int common_bits(std::int64_t i, std::int64_t j) const {
        if (j < 0 || j >= size) return -1;
        return packet::common_bits(codes[i], codes[j], i, j, dropped_bits);
    }
};

template <class Code>
__global__ void link_nodes(DeviceKeys<Code> keys, RadixHierarchy tree) {
    const unsigned i = thread_in_grid();
    if (i < tree.first_leaf()) tree.link(i, radix_node(keys, i));
}

/// Finishes a leaf, and those ancestors whose other descendants are finished.
__global__ void climb(const Reference* sorted, RadixHierarchy tree, LeafRule rule,
                      std::uint32_t* is_one_child_done) {
    const unsigned item = thread_in_grid();
    if (item >= tree.count) return;
    tree.make_leaf(item, sorted[item]);
    std::uint32_t slot = tree.first_leaf() + item;
    while (slot != 0) {
        slot = tree.parents[slot];
        __threadfence();  // releases this child to the thread that comes second
        if (atomicExch(&is_one_child_done[slot], 1u) == 0) return;
        __threadfence();  // acquires the other child
        tree.finish(slot, rule);
    }
}

template <class Code>
class Builder {
public:
    Builder(DeviceArray<Reference> references, std::uint32_t count, const BuildOptions& options)
        : count_(count),
          rule_(options),
          unsorted_(std::move(references)),
          sorted_(count_),
          nodes_(2 * std::size_t{count} - 1),
          parents_(2 * std::size_t{count} - 1),
          subtrees_(count_ - 1) {}

    DeviceHierarchy build() {
        sort();
        build_nodes(0);
        if (subtrees_.value(0, stream_).height > kMaxDepth) {
            build_nodes(dropped_bits_for_depth(kMortonBits<Code>, count_));
        }
        return {std::move(nodes_), std::move(sorted_), 2 * count_ - 1, count_};
    }

private:
    [[nodiscard]] MortonGrid<Code> measure() {
        const OrderedBounds nothing = OrderedBounds::empty();
        DeviceArray<OrderedBounds> result(std::span<const OrderedBounds>(&nothing, 1));
        for_each_item(count_, stream_, measure_centroids, unsorted_.data(), count_, result.data());
        return MortonGrid<Code>(result.value(0, stream_).bounds());
    }

    void sort() {
        SortedPairs<Code> pairs{DeviceArray<Code>(count_), DeviceArray<std::uint32_t>(count_)};
        for_each_item(count_, stream_, fill_codes<Code>, unsorted_.data(), count_, measure(),
                      pairs.keys.data(), pairs.values.data());
        pairs = radix_sort(std::move(pairs), kMortonBits<Code>, stream_.get());
        for_each_item(count_, stream_, gather_references, unsorted_.data(), pairs.values.data(),
                      count_, sorted_.data());
        stream_.synchronize();  // before `pairs` is given back
        codes_ = std::move(pairs.keys);
    }

    void build_nodes(int dropped_bits) {
        const RadixHierarchy tree{nodes_.data(), parents_.data(), subtrees_.data(), count_};
        const DeviceKeys<Code> keys{codes_.data(), count_, dropped_bits};
        DeviceArray<std::uint32_t> is_one_child_done(count_ - 1);
        is_one_child_done.fill_bytes(0, stream_.get());
        for_each_item(count_ - 1, stream_, link_nodes<Code>, keys, tree);
        for_each_item(count_, stream_, climb, sorted_.data(), tree, rule_,
                      is_one_child_done.data());
        stream_.synchronize();
    }

    Stream stream_;
    std::uint32_t count_;
    LeafRule rule_;
    DeviceArray<Reference> unsorted_, sorted_;
    DeviceArray<Code> codes_;
    DeviceArray<BuildNode> nodes_;
    DeviceArray<std::uint32_t> parents_;
    DeviceArray<RadixSubtree> subtrees_;
};

}  // namespace

/// The tree over one reference, or none.
static DeviceHierarchy build_trivial(DeviceArray<Reference> references, std::uint32_t count) {
    if (count == 0) return {};
    const Stream stream;
    const BuildNode leaf{references.value(0, stream).bounds(), 0, 0, 1};
    return {DeviceArray<BuildNode>(std::span<const BuildNode>(&leaf, 1)), std::move(references), 1,
            1};
}

DeviceHierarchy build_bvh_morton(DeviceArray<Reference> references, std::uint32_t count,
                                 const BuildOptions& options) {
    if (count < 2) return build_trivial(std::move(references), count);
    if (chosen_morton_bits(count, options) == 30) {
        return Builder<std::uint32_t>(std::move(references), count, options).build();
    }
    return Builder<std::uint64_t>(std::move(references), count, options).build();
}

}  // namespace packet::cuda
