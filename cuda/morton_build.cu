// Every step is one thread an item: the box of the centroids by reduction, codes, the sort, the
// nodes of the radix tree each from the codes around it, and their boxes from the leaves up, where
// of a node's two children the thread that comes last goes on with the node.
//
// Karras. Maximizing parallelism in the construction of BVHs, octrees, and k-d trees. HPG 2012.
#include "morton_build.h"

#include "build/bvh_morton.h"
#include "build/radix_hierarchy.h"
#include "core/morton.h"
#include "device.h"
#include "radix_sort.h"

#include <packet/cuda.h>

namespace packet::cuda {

namespace {

constexpr unsigned kBlockThreads = 256;

template <class... Parameters, class... Arguments>
void for_each_item(std::size_t count, const Stream& stream, void (*kernel)(Parameters...),
                   Arguments... arguments) {
    const auto blocks = static_cast<unsigned>((count + kBlockThreads - 1) / kBlockThreads);
    launch(kernel, {blocks, kBlockThreads, 0, stream.get()}, arguments...);
    check(cudaGetLastError(), "launch of a kernel that builds");
}

/// Floats as integers of the same order, of which atomics find the least and the greatest.
PACKET_DEVICE std::uint32_t to_ordered(float x) {
    const unsigned bits = __float_as_uint(x);
    return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
}
float from_ordered(std::uint32_t ordered) {
    const bool positive = (ordered & 0x80000000u) != 0;
    return std::bit_cast<float>(positive ? ordered & 0x7FFFFFFFu : ~ordered);
}

struct OrderedBounds {
    std::uint32_t lower[3], upper[3];
};

/// A warp's least or greatest in all its lanes, then one atomic for all of them.
PACKET_DEVICE void reduce_min(std::uint32_t* to, std::uint32_t value) {
    for (int bit = 16; bit != 0; bit /= 2) {
        const std::uint32_t other = __shfl_xor_sync(kFullWarp, value, bit);
        value = other < value ? other : value;
    }
    if (lane_id() == 0) atomicMin(to, value);
}
PACKET_DEVICE void reduce_max(std::uint32_t* to, std::uint32_t value) {
    for (int bit = 16; bit != 0; bit /= 2) {
        const std::uint32_t other = __shfl_xor_sync(kFullWarp, value, bit);
        value = other > value ? other : value;
    }
    if (lane_id() == 0) atomicMax(to, value);
}

/// The box of doubled centroids. Threads beyond the end repeat the last reference.
__global__ void measure_centroids(const Reference* references, std::uint32_t count,
                                  OrderedBounds* out) {
    const unsigned i = thread_in_grid();
    const Reference& r = references[i < count ? i : count - 1];
    const float centroid[3] = {r.lower.x + r.upper.x, r.lower.y + r.upper.y, r.lower.z + r.upper.z};
    for (int a = 0; a < 3; ++a) {
        reduce_min(&out->lower[a], to_ordered(centroid[a]));
        reduce_max(&out->upper[a], to_ordered(centroid[a]));
    }
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
    Builder(std::span<const Reference> references, const BuildOptions& options)
        : count_(static_cast<std::uint32_t>(references.size())),
          rule_(options),
          unsorted_(references),
          sorted_(count_),
          nodes_(2 * references.size() - 1),
          parents_(2 * references.size() - 1),
          subtrees_(count_ - 1) {}

    Hierarchy build() {
        sort();
        build_nodes(0);
        if (root_height() > kMaxDepth) {
            build_nodes(dropped_bits_for_depth(kMortonBits<Code>, count_));
        }
        Hierarchy out;
        out.nodes.resize(nodes_.size());
        ScratchVector<Reference> sorted(count_);
        nodes_.copy_to(out.nodes, stream_.get());
        sorted_.copy_to(sorted, stream_.get());
        stream_.synchronize();
        out.ids = ids_of(sorted, Parallel(1));
        return out;
    }

private:
    [[nodiscard]] MortonGrid<Code> measure() {
        OrderedBounds ordered;
        for (int a = 0; a < 3; ++a) ordered.lower[a] = 0xFFFFFFFFu, ordered.upper[a] = 0;
        DeviceArray<OrderedBounds> result(std::span<const OrderedBounds>(&ordered, 1));
        for_each_item(count_, stream_, measure_centroids, unsorted_.data(), count_, result.data());
        result.copy_to({&ordered, 1}, stream_.get());
        stream_.synchronize();
        Bounds3f bounds;
        for (int a = 0; a < 3; ++a) {
            bounds.lower[a] = from_ordered(ordered.lower[a]);
            bounds.upper[a] = from_ordered(ordered.upper[a]);
        }
        return MortonGrid<Code>(bounds);
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

    [[nodiscard]] int root_height() const {
        RadixSubtree root;
        check(cudaMemcpyAsync(&root, subtrees_.data(), sizeof(root), cudaMemcpyDeviceToHost,
                              stream_.get()),
              "copy from the device");
        stream_.synchronize();
        return root.height;
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

Hierarchy build_bvh_morton(std::span<const Reference> references, const BuildOptions& options) {
    (void)device_name();  // throws if there is none
    if (references.size() < 2) {
        return packet::build_bvh_morton({references.begin(), references.end()}, options,
                                        Parallel(1));
    }
    if (chosen_morton_bits(references.size(), options) == 30) {
        return Builder<std::uint32_t>(references, options).build();
    }
    return Builder<std::uint64_t>(references, options).build();
}

}  // namespace packet::cuda
