#include "kd_step.h"

#include "build/cell.h"
#include "build/hierarchy.h"
#include "build/kd_large_stage.h"
#include "build/split.h"
#include "build/triangle_clipper.h"
#include "radix_sort.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace packet::cuda {

namespace {

// Where a reference goes, in bits.
constexpr std::uint8_t kTo0 = 1, kTo1 = 2, kIsCut = 4;

__global__ void fill_sides(KdLevelView level, KdStep::View step) {
    const unsigned i = thread_in_grid();
    if (i >= level.reference_count) return;
    const std::uint32_t cell = level.cell_of[i];
    std::uint8_t side = kTo0;  // a leaf's
    if (step.fates[cell] == KdFate::kCut) {
        const int to = step.planes[cell].side_of(level.references[i]);
        side = to == kBothSides ? kTo0 | kTo1 | kIsCut : to == 0 ? kTo0 : kTo1;
    }
    step.sides[i] = side;
}

/// By which references are halved, in the order of cells and then of centroids.
__global__ void fill_centroid_keys(KdLevelView level, std::uint64_t* keys, std::uint32_t* values) {
    const unsigned i = thread_in_grid();
    if (i >= level.reference_count) return;
    const Reference& r = level.references[i];
    const int axis = widest_axis(level.cells[level.cell_of[i]].bounds);
    const float centroid2 = r.lower[axis] + r.upper[axis];
    keys[i] = std::uint64_t{level.cell_of[i]} << 32 | to_ordered(centroid2);
    values[i] = i;
}

/// `sorted[p]` is the reference at place p. Cells have their places where they have their
/// references.
__global__ void halve(KdLevelView level, const std::uint32_t* sorted, KdStep::View step) {
    const unsigned p = thread_in_grid();
    if (p >= level.reference_count) return;
    const std::uint32_t i = sorted[p];
    const std::uint32_t cell_id = level.cell_of[i];
    if (step.fates[cell_id] != KdFate::kHalved) return;
    const KdSetCell& cell = level.cells[cell_id];
    step.sides[i] = p - cell.first < cell.count / 2 ? kTo0 : kTo1;
}

__global__ void keep_leaves(KdLevelView level, KdStep::View step) {
    const unsigned i = thread_in_grid();
    if (i >= level.reference_count) return;
    if (step.fates[level.cell_of[i]] == KdFate::kLeaf) step.sides[i] = kTo0;
}

__global__ void count_sides(const std::uint8_t* sides, std::uint32_t count, std::uint64_t* out) {
    const unsigned i = thread_in_grid();
    if (i >= count) return;
    out[i] = pack({(sides[i] & kTo0) != 0 ? 1u : 0u, (sides[i] & kTo1) != 0 ? 1u : 0u});
}

__global__ void find_cuts(const std::uint8_t* sides, std::uint32_t count, std::uint32_t* is_cut) {
    const unsigned i = thread_in_grid();
    if (i < count) is_cut[i] = (sides[i] & kIsCut) != 0 ? 1 : 0;
}

__global__ void list_cuts(const std::uint8_t* sides, std::uint32_t count,
                          const std::uint32_t* cut_sums, std::uint32_t* cut_references) {
    const unsigned i = thread_in_grid();
    if (i < count && (sides[i] & kIsCut) != 0) cut_references[cut_sums[i]] = i;
}

/// How many references of a cell go to either side.
PACKET_DEVICE CountPair counts_of(const KdSetCell& cell, const std::uint64_t* side_sums) {
    return unpack_counts(side_sums[cell.first + cell.count] - side_sums[cell.first]);
}

/// What its plane would lead too deep is halved, or stays a leaf where it may.
__global__ void limit_depth(KdLevelView level, KdStage stage, KdLimits limits, KdStep::View step,
                            std::uint32_t* changed) {
    const unsigned i = thread_in_grid();
    if (i >= level.cell_count || step.fates[i] != KdFate::kCut) return;
    const KdSetCell& cell = level.cells[i];
    const CountPair count = counts_of(cell, step.side_sums);
    if (fits_depth(cell.depth + 1, std::max(count.low, count.high))) return;
    const bool may_be_leaf = stage == KdStage::kSmall && cell.count <= limits.max_leaf_size;
    step.fates[i] = may_be_leaf ? KdFate::kLeaf : KdFate::kHalved;
    atomicAdd(changed, 1u);
}

__global__ void count_halved(const KdFate* fates, std::uint32_t count, std::uint32_t* halved) {
    const unsigned i = thread_in_grid();
    if (i < count && fates[i] == KdFate::kHalved) atomicAdd(halved, 1u);
}

__global__ void cut_triangles(KdLevelView level, DeviceMesh mesh, KdStep::View step,
                              const std::uint32_t* cut_references, std::uint32_t count) {
    const unsigned k = thread_in_grid();
    if (k >= count) return;
    const std::uint32_t i = cut_references[k];
    const Reference& r = level.references[i];
    const KdPlane& plane = step.planes[level.cell_of[i]];
    const glm::uvec3 triangle = mesh.triangles[r.id];
    const CutBounds parts = cut_bounds(
        {mesh.positions[triangle.x], mesh.positions[triangle.y], mesh.positions[triangle.z]},
        r.bounds(), plane.axis, plane.position);
    std::uint8_t sides = kIsCut;
    for (std::uint32_t s = 0; s < 2; ++s) {
        step.parts[2 * k + s] = parts.side[s];
        if (!parts.side[s].empty()) sides |= s == 0 ? kTo0 : kTo1;
    }
    step.sides[i] = sides;
}

/// Children with their numbers of references, and how many references and cells go where.
__global__ void make_children(KdLevelView level, KdStage stage, KdStep::View step,
                              std::uint64_t* reference_counts, std::uint64_t* cell_counts,
                              std::uint32_t* is_parent) {
    const unsigned i = thread_in_grid();
    if (i >= level.cell_count) return;
    const KdSetCell& cell = level.cells[i];
    const bool is_leaf = step.fates[i] == KdFate::kLeaf;
    const CountPair count = counts_of(cell, step.side_sums);
    KdRange child[2];
    child[0].count = count.low;
    child[1].count = count.high;
    if (is_leaf) {
        child[0].depth = cell.depth;
    } else {
        child[0].depth = child[1].depth = cell.depth + 1;
        share_out<KdRange>(cell, child);
    }
    is_parent[i] = count.low != 0 && count.high != 0 ? 1 : 0;
    for (std::uint32_t s = 0; s < 2; ++s) {
        const bool goes_out = stage == KdStage::kLarge ? child[s].count <= kMaxSmallCell : is_leaf;
        const auto references = static_cast<std::uint32_t>(child[s].count);
        const std::uint32_t cells = references != 0 ? 1 : 0;
        step.children[2 * i + s] = child[s];
        step.bounds[2 * i + s] = OrderedBounds::empty();
        step.sets[2 * i + s] = 0;
        step.destinations[2 * i + s].goes_out = goes_out;
        reference_counts[2 * i + s] =
            pack(goes_out ? CountPair{0, references} : CountPair{references, 0});
        cell_counts[2 * i + s] = pack(goes_out ? CountPair{0, cells} : CountPair{cells, 0});
    }
}

/// Where places begin in what there was before.
struct KdBases {
    std::uint32_t out_reference, out_cell, node;
};

PACKET_DEVICE std::uint32_t place_of(std::uint64_t sums, bool goes_out, std::uint32_t out_base) {
    const CountPair sum = unpack_counts(sums);
    return goes_out ? out_base + sum.high : sum.low;
}

/// Gives children their places and nodes.
__global__ void place_children(KdLevelView level, KdStep::View step, KdBases bases,
                               const std::uint64_t* reference_sums, const std::uint64_t* cell_sums,
                               const std::uint32_t* is_parent, const std::uint32_t* parent_sums,
                               BuildNode* nodes, KdSetCell* next, KdSetCell* out) {
    const unsigned i = thread_in_grid();
    if (i >= level.cell_count) return;
    const KdSetCell& cell = level.cells[i];
    const std::uint32_t first_node = bases.node + 2 * parent_sums[i];
    if (is_parent[i] != 0) {
        nodes[cell.node] = {cell.bounds, first_node, first_node + 1, 0};
    }
    for (std::uint32_t s = 0; s < 2; ++s) {
        const std::uint32_t c = 2 * i + s;
        KdDestination& to = step.destinations[c];
        to.first = place_of(reference_sums[c], to.goes_out, bases.out_reference);
        to.cell = place_of(cell_sums[c], to.goes_out, bases.out_cell);
        if (step.children[c].count == 0) continue;
        KdSetCell child{step.children[c], 0, cell.root};
        child.first = to.first;
        // A node of one child is that child.
        child.node = is_parent[i] != 0 ? first_node + s : cell.node;
        (to.goes_out ? out : next)[to.cell] = child;
    }
}

/// What kernels see of a level that is filled.
struct KdTarget {
    Reference* references;
    std::uint32_t* cell_of;
};

/// Extends the boxes of children, by one atomic a warp where all its lanes have the same cell.
PACKET_DEVICE void extend_child(const KdStep::View& step, std::uint32_t child, bool is_one_cell,
                                bool goes, const OrderedBounds& box) {
    if (is_one_cell) {
        if (__any_sync(kFullWarp, goes)) {
            extend_by_warp(step.bounds[child], goes ? box : OrderedBounds::empty());
        }
    } else if (goes) {
        extend_atomically(step.bounds[child], box);
    }
}

__global__ void move_references(KdLevelView level, KdStage stage, KdStep::View step, KdTarget next,
                                KdTarget out) {
    const unsigned thread = thread_in_grid();
    const bool exists = thread < level.reference_count;
    const unsigned i = exists ? thread : level.reference_count - 1;
    const std::uint32_t cell_id = level.cell_of[i];
    const bool is_one_cell =
        __all_sync(kFullWarp, cell_id == __shfl_sync(kFullWarp, cell_id, 0)) != 0;
    const Reference& r = level.references[i];
    const std::uint8_t sides = exists ? step.sides[i] : std::uint8_t{0};
    const CountPair rank =
        unpack_counts(step.side_sums[i] - step.side_sums[level.cells[cell_id].first]);
    for (std::uint32_t s = 0; s < 2; ++s) {
        const std::uint32_t child = 2 * cell_id + s;
        const bool goes = (sides & (s == 0 ? kTo0 : kTo1)) != 0;
        const Bounds3f box =
            (sides & kIsCut) != 0 ? step.parts[2 * step.cut_sums[i] + s] : r.bounds();
        if (goes) {
            const KdDestination& to = step.destinations[child];
            const std::uint32_t place = to.first + (s == 0 ? rank.low : rank.high);
            const KdTarget& target = to.goes_out ? out : next;
            target.references[place] = {box.lower, r.id, box.upper, r.unused};
            target.cell_of[place] = to.cell;
            if (stage == KdStage::kSmall) {
                atomicOr(reinterpret_cast<unsigned long long*>(&step.sets[child]),
                         1ull << r.unused);
            }
        }
        extend_child(step, child, is_one_cell, goes, OrderedBounds::from(box));
    }
}

__global__ void finish_children(std::uint32_t cell_count, KdStep::View step, KdSetCell* next,
                                KdSetCell* out) {
    const unsigned c = thread_in_grid();
    if (c >= 2 * cell_count || step.children[c].count == 0) return;
    const KdDestination& to = step.destinations[c];
    KdSetCell& child = (to.goes_out ? out : next)[to.cell];
    child.bounds = step.bounds[c].bounds();
    child.set = step.sets[c];
}

}  // namespace

KdStep::View KdStep::view() const {
    return {planes_.data(),   fates_.data(),       sides_.data(),    side_sums_.data(),
            cut_sums_.data(), parts_.data(),       children_.data(), bounds_.data(),
            sets_.data(),     destinations_.data()};
}

void KdStep::make_room(const KdDeviceLevel& level) {
    const std::size_t references = level.reference_count, cells = level.cell_count;
    sides_.make_room(references);
    side_counts_.make_room(references);
    side_sums_.make_room(references + 1);
    is_cut_.make_room(references);
    cut_sums_.make_room(references + 1);
    planes_.make_room(cells);
    fates_.make_room(cells);
    is_parent_.make_room(cells);
    parent_sums_.make_room(cells + 1);
    children_.make_room(2 * cells);
    bounds_.make_room(2 * cells);
    sets_.make_room(2 * cells);
    destinations_.make_room(2 * cells);
    reference_counts_.make_room(2 * cells);
    reference_sums_.make_room(2 * cells + 1);
    cell_counts_.make_room(2 * cells);
    cell_sums_.make_room(2 * cells + 1);
}

void KdStep::advance(KdDeviceLevel& level, KdDeviceLevel& out, KdNodes& nodes) {
    choose_sides(level);
    cut(level);
    sum_sides(level);
    if (stage_ == KdStage::kSmall) {
        check_depth(level);
        if (counter_.value(0, stream_) != 0) {
            part_without_cutting(level);
            sum_sides(level);
        }
    }
    move(level, out, nodes);
}

void KdStep::choose_sides(const KdDeviceLevel& level) {
    for_each_item(level.reference_count, stream_, fill_sides, level.view(), view());
    if (stage_ == KdStage::kLarge) {
        // Before they are cut: cutting takes away only what is not there.
        sum_sides(level);
        check_depth(level);
    }
    counter_.fill_bytes(0, stream_.get());
    for_each_item(level.cell_count, stream_, count_halved, fates_.data(), level.cell_count,
                  counter_.data());
    if (counter_.value(0, stream_) != 0) part_without_cutting(level);
}

void KdStep::check_depth(const KdDeviceLevel& level) {
    counter_.fill_bytes(0, stream_.get());
    for_each_item(level.cell_count, stream_, limit_depth, level.view(), stage_, limits_, view(),
                  counter_.data());
}

/// Sides of references of cells that are halved or left whole. A sort of the whole level, but few
/// levels have such cells.
void KdStep::part_without_cutting(const KdDeviceLevel& level) {
    const std::uint32_t count = level.reference_count;
    SortedPairs<std::uint64_t> pairs{DeviceArray<std::uint64_t>(count),
                                     DeviceArray<std::uint32_t>(count)};
    for_each_item(count, stream_, fill_centroid_keys, level.view(), pairs.keys.data(),
                  pairs.values.data());
    const int bits = 32 + static_cast<int>(std::bit_width(level.cell_count));
    pairs = radix_sort(std::move(pairs), bits, stream_.get());
    for_each_item(count, stream_, halve, level.view(), pairs.values.data(), view());
    for_each_item(count, stream_, keep_leaves, level.view(), view());
    stream_.synchronize();  // before `pairs` is given back
}

void KdStep::sum_sides(const KdDeviceLevel& level) {
    const std::uint32_t count = level.reference_count;
    for_each_item(count, stream_, count_sides, sides_.data(), count, side_counts_.data());
    prefix_sums_(side_counts_.data(), side_sums_.data(), count, stream_.get());
}

void KdStep::cut(const KdDeviceLevel& level) {
    const std::uint32_t count = level.reference_count;
    for_each_item(count, stream_, find_cuts, sides_.data(), count, is_cut_.data());
    prefix_sums_(is_cut_.data(), cut_sums_.data(), count, stream_.get());
    const std::uint32_t cuts = cut_sums_.value(count, stream_);
    cut_references_.make_room(cuts);
    parts_.make_room(std::size_t{2} * cuts);
    for_each_item(count, stream_, list_cuts, sides_.data(), count, cut_sums_.data(),
                  cut_references_.data());
    for_each_item(cuts, stream_, cut_triangles, level.view(), mesh_, view(), cut_references_.data(),
                  cuts);
}

void KdStep::move(KdDeviceLevel& level, KdDeviceLevel& out, KdNodes& nodes) {
    const std::uint32_t cells = level.cell_count, children = 2 * cells;
    for_each_item(cells, stream_, make_children, level.view(), stage_, view(),
                  reference_counts_.data(), cell_counts_.data(), is_parent_.data());
    prefix_sums_(reference_counts_.data(), reference_sums_.data(), children, stream_.get());
    prefix_sums_(cell_counts_.data(), cell_sums_.data(), children, stream_.get());
    prefix_sums_(is_parent_.data(), parent_sums_.data(), cells, stream_.get());
    std::uint64_t reference_sum, cell_sum;
    std::uint32_t parents;
    reference_sums_.copy_value(children, &reference_sum, stream_.get());
    cell_sums_.copy_value(children, &cell_sum, stream_.get());
    parent_sums_.copy_value(cells, &parents, stream_.get());
    stream_.synchronize();
    const CountPair references = unpack_counts(reference_sum), new_cells = unpack_counts(cell_sum);
    const std::uint32_t new_nodes = 2 * parents;
    next_.reference_count = next_.cell_count = 0;
    next_.grow(references.low, new_cells.low, stream_);
    out.grow(references.high, new_cells.high, stream_);
    nodes.nodes.grow(nodes.count + new_nodes, nodes.count, stream_);
    for_each_item(cells, stream_, place_children, level.view(), view(),
                  KdBases{out.reference_count, out.cell_count, nodes.count}, reference_sums_.data(),
                  cell_sums_.data(), is_parent_.data(), parent_sums_.data(), nodes.nodes.data(),
                  next_.cells.data(), out.cells.data());
    for_each_item(level.reference_count, stream_, move_references, level.view(), stage_, view(),
                  KdTarget{next_.references.data(), next_.cell_of.data()},
                  KdTarget{out.references.data(), out.cell_of.data()});
    for_each_item(children, stream_, finish_children, cells, view(), next_.cells.data(),
                  out.cells.data());
    next_.reference_count = references.low;
    next_.cell_count = new_cells.low;
    out.reference_count += references.high;
    out.cell_count += new_cells.high;
    nodes.count += new_nodes;
    std::swap(level, next_);
}

}  // namespace packet::cuda
