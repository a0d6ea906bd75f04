#include "kd_numbering.h"

#include <vector>

namespace packet::cuda {

namespace {

/// What is below a node, and its numbers in the hierarchy.
struct Numbers {
    std::uint32_t inner_count, reference_count;
    std::uint32_t place;  ///< of the node
    std::uint32_t first;  ///< inner: the place of its first child; leaf: of its first reference
    std::uint32_t references;  ///< where its references begin
};

struct NodeSpan {
    std::uint32_t begin, end;
};

__global__ void fill_leaves(KdLevelView leaves, BuildNode* nodes) {
    const unsigned i = thread_in_grid();
    if (i >= leaves.cell_count) return;
    const KdSetCell& leaf = leaves.cells[i];
    nodes[leaf.node] = {leaf.bounds, static_cast<std::uint32_t>(leaf.first), 0,
                        static_cast<std::uint32_t>(leaf.count)};
}

/// For the nodes of one level, whose children have been counted.
__global__ void count_below(const BuildNode* nodes, NodeSpan level, Numbers* numbers) {
    const unsigned i = level.begin + thread_in_grid();
    if (i >= level.end) return;
    const BuildNode& node = nodes[i];
    if (node.is_leaf()) {
        numbers[i].inner_count = 0;
        numbers[i].reference_count = node.count;
        return;
    }
    const Numbers &first = numbers[node.first], &second = numbers[node.second];
    numbers[i].inner_count = 1 + first.inner_count + second.inner_count;
    numbers[i].reference_count = first.reference_count + second.reference_count;
}

__global__ void count_roots(const Numbers* numbers, std::uint32_t count, std::uint64_t* sizes) {
    const unsigned i = thread_in_grid();
    if (i >= count) return;
    sizes[i] = pack({1 + 2 * numbers[i].inner_count, numbers[i].reference_count});
}

__global__ void place_roots(Numbers* numbers, std::uint32_t count, const std::uint64_t* size_sums,
                            CountPair bases) {
    const unsigned i = thread_in_grid();
    if (i >= count) return;
    const CountPair before = unpack_counts(size_sums[i]);
    numbers[i].place = bases.low + before.low;
    numbers[i].first = numbers[i].place + 1;
    numbers[i].references = bases.high + before.high;
}

/// Places the children of one level's nodes. Nodes get their children's places in the order in
/// which they are visited depth first.
__global__ void place_children_of(const BuildNode* nodes, NodeSpan level, Numbers* numbers) {
    const unsigned i = level.begin + thread_in_grid();
    if (i >= level.end || nodes[i].is_leaf()) return;
    const Numbers& self = numbers[i];
    Numbers &first = numbers[nodes[i].first], &second = numbers[nodes[i].second];
    first.place = self.first;
    first.first = self.first + 2;
    first.references = self.references;
    second.place = self.first + 1;
    second.first = self.first + 2 + 2 * first.inner_count;
    second.references = self.references + first.reference_count;
}

__global__ void copy_nodes(const BuildNode* nodes, std::uint32_t count, const Numbers* numbers,
                           const KdSetCell* roots, std::uint32_t root_count, BuildNode* out) {
    const unsigned i = thread_in_grid();
    if (i >= count) return;
    BuildNode node = nodes[i];
    const bool is_leaf = node.is_leaf();
    node.first = is_leaf ? numbers[i].references : numbers[i].first;
    node.second = is_leaf ? 0 : node.first + 1;
    out[numbers[i].place] = node;
    if (i < root_count) out[roots[i].node] = node;
}

__global__ void copy_references(KdLevelView leaves, const Numbers* numbers, Reference* out) {
    const unsigned i = thread_in_grid();
    if (i >= leaves.reference_count) return;
    const KdSetCell& leaf = leaves.cells[leaves.cell_of[i]];
    const Reference& r = leaves.references[i];
    const auto place = i - static_cast<std::uint32_t>(leaf.first);
    out[numbers[leaf.node].references + place] = {r.lower, r.id, r.upper};
}

}  // namespace

void append_batch(const KdBatchNodes& batch, const KdDeviceLevel& leaves, const KdSetCell* roots,
                  std::uint32_t root_count, DeviceHierarchy& out, const Stream& stream) {
    const BuildNode* const nodes = batch.nodes.nodes.data();
    DeviceArray<Numbers> numbers(batch.nodes.count);
    for_each_item(leaves.cell_count, stream, fill_leaves, leaves.view(), batch.nodes.nodes.data());
    std::vector<NodeSpan> levels;
    std::uint32_t begin = 0;
    for (const std::uint32_t end : batch.level_ends) {
        if (end != begin) levels.push_back({begin, end});
        begin = end;
    }
    for (std::size_t i = levels.size(); i-- > 0;) {
        const NodeSpan& level = levels[i];
        for_each_item(level.end - level.begin, stream, count_below, nodes, level, numbers.data());
    }
    DeviceArray<std::uint64_t> sizes(root_count), size_sums(root_count + 1);
    PrefixSums prefix_sums;
    for_each_item(root_count, stream, count_roots, numbers.data(), root_count, sizes.data());
    prefix_sums(sizes.data(), size_sums.data(), root_count, stream.get());
    for_each_item(root_count, stream, place_roots, numbers.data(), root_count, size_sums.data(),
                  CountPair{out.node_count, out.reference_count});
    for (const NodeSpan& level : levels) {
        for_each_item(level.end - level.begin, stream, place_children_of, nodes, level,
                      numbers.data());
    }
    out.nodes.grow(out.node_count + batch.nodes.count, out.node_count, stream);
    out.references.grow(out.reference_count + leaves.reference_count, out.reference_count, stream);
    for_each_item(batch.nodes.count, stream, copy_nodes, nodes, batch.nodes.count, numbers.data(),
                  roots, root_count, out.nodes.data());
    for_each_item(leaves.reference_count, stream, copy_references, leaves.view(), numbers.data(),
                  out.references.data());
    stream.synchronize();  // before the numbers are given back
    out.node_count += batch.nodes.count;
    out.reference_count += leaves.reference_count;
}

}  // namespace packet::cuda
