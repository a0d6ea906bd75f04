#include "kd_planes.h"

#include "build/kd_bins.h"
#include "ordered_bounds.h"

#include <algorithm>

namespace packet::cuda {

namespace {

static_assert(kKdBinCount == kWarpSize, "a lane has a bin of each axis");

// ---- What both have in common ----

/// Whether `a` is looked at before `b` where they cost the same: the kernels' lanes look at planes
/// of one axis in the order of their positions.
enum class Ascending : std::uint8_t { kNo, kYes };

PACKET_DEVICE bool is_better(const KdPlane& a, const KdPlane& b, Ascending order) {
    if (a.cost != b.cost) return a.cost < b.cost;
    if (a.axis != b.axis) return a.axis < b.axis;
    return order == Ascending::kYes ? a.position < b.position : a.position > b.position;
}

/// The best of the lanes' planes, in all of them, as if one thread had looked at all.
PACKET_DEVICE KdPlane warp_best(KdPlane plane, Ascending order) {
    for (int bit = 16; bit != 0; bit /= 2) {
        KdPlane other;
        other.cost = __shfl_xor_sync(kFullWarp, plane.cost, bit);
        other.position = __shfl_xor_sync(kFullWarp, plane.position, bit);
        other.axis = __shfl_xor_sync(kFullWarp, plane.axis, bit);
        other.flat_side = __shfl_xor_sync(kFullWarp, plane.flat_side, bit);
        if (is_better(other, plane, order)) plane = other;
    }
    return plane;
}

/// The highest lane of `lanes` below this one; this one if there is none.
PACKET_DEVICE int lane_before(unsigned lanes) {
    const unsigned below = lanes & lanes_below();
    return below == 0 ? static_cast<int>(lane_id()) : 31 - __clz(static_cast<int>(below));
}

// ---- Bins ----

// References of a chunk, which a block counts: many more than the words it then adds to the cell's.
constexpr std::uint32_t kChunkSize = 2048;
constexpr std::uint32_t kWordsOfBin = 4, kWordsOfAxis = kWordsOfBin * kKdBinCount;
constexpr std::uint32_t kWordsOfCell = 3 * kWordsOfAxis;

enum BinWord : std::uint32_t { kStartCount, kEndCount, kFirstStart, kLastEnd };

PACKET_DEVICE std::uint32_t empty_word(std::uint32_t word) {
    const std::uint32_t which = word % kWordsOfBin;
    if (which == kFirstStart) return to_ordered(std::numeric_limits<float>::infinity());
    if (which == kLastEnd) return to_ordered(-std::numeric_limits<float>::infinity());
    return 0;
}

__global__ void count_chunks(KdLevelView level, std::uint32_t* counts) {
    const unsigned i = thread_in_grid();
    if (i >= level.cell_count) return;
    counts[i] = static_cast<std::uint32_t>((level.cells[i].count + kChunkSize - 1) / kChunkSize);
}

__global__ void clear_bins(std::uint32_t* bins, std::uint32_t count) {
    const unsigned i = thread_in_grid();
    if (i < count) bins[i] = empty_word(i);
}

/// The cell of a chunk: the last whose first chunk is not behind it.
PACKET_DEVICE std::uint32_t cell_of_chunk(const std::uint32_t* first_chunks,
                                          std::uint32_t cell_count, std::uint32_t chunk) {
    std::uint32_t begin = 0, end = cell_count;
    while (end - begin > 1) {
        const std::uint32_t middle = begin + (end - begin) / 2;
        (first_chunks[middle] <= chunk ? begin : end) = middle;
    }
    return begin;
}

PACKET_DEVICE void count_reference(const Reference& r, const Bounds3f& cell,
                                   const SharedArray<std::uint32_t>& bins) {
    for (int a = 0; a < 3; ++a) {
        const KdBinOf bin_of(cell.lower[a], cell.upper[a]);
        const auto word_of = [&](float position) {
            return static_cast<std::uint32_t>(a) * kWordsOfAxis +
                   static_cast<std::uint32_t>(bin_of(position)) * kWordsOfBin;
        };
        const std::uint32_t start = word_of(r.lower[a]), end = word_of(r.upper[a]);
        bins.atomic_add(start + kStartCount, 1u);
        bins.atomic_min(start + kFirstStart, to_ordered(r.lower[a]));
        bins.atomic_add(end + kEndCount, 1u);
        bins.atomic_max(end + kLastEnd, to_ordered(r.upper[a]));
    }
}

PACKET_DEVICE void join_word(std::uint32_t* to, std::uint32_t word, std::uint32_t value) {
    if (value == empty_word(word)) return;
    switch (word % kWordsOfBin) {
        case kFirstStart: atomicMin(to + word, value); break;
        case kLastEnd: atomicMax(to + word, value); break;
        default: atomicAdd(to + word, value); break;
    }
}

/// A block counts a chunk in shared memory and adds what it has counted to the cell's bins.
__global__ void fill_bins(KdLevelView level, const std::uint32_t* first_chunks,
                          std::uint32_t* bins) {
    if (blockIdx.x >= first_chunks[level.cell_count]) return;
    const SharedArray<std::uint32_t> counted(0, kWordsOfCell);
    for (std::uint32_t word = threadIdx.x; word < kWordsOfCell; word += blockDim.x) {
        counted[word] = empty_word(word);
    }
    __syncthreads();
    const std::uint32_t cell_id = cell_of_chunk(first_chunks, level.cell_count, blockIdx.x);
    const KdSetCell& cell = level.cells[cell_id];
    const auto first =
        static_cast<std::uint32_t>(cell.first) + (blockIdx.x - first_chunks[cell_id]) * kChunkSize;
    const auto end = static_cast<std::uint32_t>(
        std::min<std::size_t>(first + kChunkSize, cell.first + cell.count));
    for (std::uint32_t i = first + threadIdx.x; i < end; i += blockDim.x) {
        count_reference(level.references[i], cell.bounds, counted);
    }
    __syncthreads();
    for (std::uint32_t word = threadIdx.x; word < kWordsOfCell; word += blockDim.x) {
        join_word(bins + std::size_t{cell_id} * kWordsOfCell, word, counted[word]);
    }
}

/// A bin in one load of 16 bytes.
PACKET_DEVICE KdBin load_bin(const std::uint32_t* words) {
    const uint4 bin = *reinterpret_cast<const uint4*>(words);
    return {bin.x, bin.y, from_ordered(bin.z), from_ordered(bin.w)};
}

/// The sum of the lanes below this one.
PACKET_DEVICE std::uint32_t warp_sum_before(std::uint32_t value) {
    std::uint32_t sum = value;
    for (unsigned lanes = 1; lanes < kWarpSize; lanes *= 2) {
        const std::uint32_t other = __shfl_up_sync(kFullWarp, sum, lanes);
        if (lane_id() >= lanes) sum += other;
    }
    return sum - value;
}

/// A warp a cell, a lane a bin.
__global__ void choose_binned_planes(KdLevelView level, KdLimits limits, const std::uint32_t* bins,
                                     KdPlane* planes, KdFate* fates) {
    const unsigned id = warp_in_grid();
    if (id >= level.cell_count) return;
    const KdRange& cell = level.cells[id];
    KdPlane plane;
    if (cell.depth < limits.max_cut_depth) {
        const KdCost cost(cell, limits.prices);
        KdSearch<KdRange> search(cell, cost);
        for (int a = 0; a < 3; ++a) {
            const KdBin bin = load_bin(bins + std::size_t{id} * kWordsOfCell +
                                       static_cast<std::size_t>(a) * kWordsOfAxis +
                                       std::size_t{lane_id()} * kWordsOfBin);
            KdBinsBefore before;
            before.started = warp_sum_before(bin.start_count);
            before.ended = warp_sum_before(bin.end_count);
            const unsigned ends = __ballot_sync(kFullWarp, bin.end_count != 0);
            const float last_end = __shfl_sync(kFullWarp, bin.last_end, lane_before(ends));
            if ((ends & lanes_below()) != 0) before.last_end = last_end;
            consider_planes(bin, before, a, search);
        }
        plane = warp_best(search.best, Ascending::kYes);
    }
    if (lane_id() != 0) return;
    planes[id] = plane;
    fates[id] = plane.is_cut() ? KdFate::kCut : KdFate::kHalved;
}

// ---- Masks ----

/// The places of a small cell along an axis, as KdMasks::fill() finds them: of those where starts
/// and ends coincide the first counts, starts before ends.
struct Faces {
    const Reference* references;
    std::uint32_t count;
    int axis;

    PACKET_DEVICE float position(std::uint32_t face) const {
        const Reference& r = references[face % kMaxSetSize];
        return face < kMaxSetSize ? r.lower[axis] : r.upper[axis];
    }
    PACKET_DEVICE bool exists(std::uint32_t face) const { return face % kMaxSetSize < count; }

    /// The masks at a face, and whether no face before it is at the same place.
    PACKET_DEVICE KdMaskPlace place(std::uint32_t face, bool& is_first) const {
        KdMaskPlace out{position(face), 0, 0, 0, 0};
        is_first = true;
        for (std::uint32_t i = 0; i < count; ++i) {
            const KdSet bit = KdSet{1} << i;
            const float lower = references[i].lower[axis], upper = references[i].upper[axis];
            if (lower == out.position) out.starts |= bit;
            if (upper == out.position) out.ends |= bit;
            if (lower < out.position) out.before |= bit;
            if (upper > out.position) out.behind |= bit;
            if (lower == out.position && i < face) is_first = false;
            if (upper == out.position && i + kMaxSetSize < face) is_first = false;
        }
        return out;
    }
    /// How many of the places that the faces of these sets stand for come before.
    PACKET_DEVICE std::uint32_t rank(float at, KdSet starts, KdSet ends) const {
        std::uint32_t out = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
            out += (starts >> i & 1) != 0 && references[i].lower[axis] < at;
            out += (ends >> i & 1) != 0 && references[i].upper[axis] < at;
        }
        return out;
    }
};

PACKET_DEVICE KdSet ballot_pair(bool low, bool high) {
    const KdSet first = __ballot_sync(kFullWarp, low);
    return first | KdSet{__ballot_sync(kFullWarp, high)} << kWarpSize;
}

/// A warp a small cell and axis; lane l has faces l, l + 32, l + 64 and l + 96.
__global__ void make_masks(KdLevelView level, KdMaskPlanes::View masks) {
    const unsigned item = warp_in_grid();
    if (item >= 3 * level.cell_count) return;
    const unsigned axis = item / level.cell_count, id = item % level.cell_count;
    const KdSetCell& cell = level.cells[id];
    const Faces faces{level.references + cell.first, static_cast<std::uint32_t>(cell.count),
                      static_cast<int>(axis)};
    KdMaskPlace place[4];
    bool is_first[4];
    for (std::uint32_t k = 0; k < 4; ++k) {
        const std::uint32_t face = lane_id() + k * kWarpSize;
        is_first[k] = false;
        if (faces.exists(face)) place[k] = faces.place(face, is_first[k]);
    }
    const KdSet starts = ballot_pair(is_first[0], is_first[1]);
    const KdSet ends = ballot_pair(is_first[2], is_first[3]);
    const auto first_place = static_cast<std::uint32_t>(2 * cell.first);
    KdMaskPlace* const to = masks.places + std::size_t{axis} * masks.places_an_axis + first_place;
    for (std::uint32_t k = 0; k < 4; ++k) {
        if (is_first[k]) to[faces.rank(place[k].position, starts, ends)] = place[k];
    }
    if (lane_id() != 0) return;
    masks.place_counts[item] = static_cast<std::uint32_t>(set_bits(starts) + set_bits(ends));
    if (axis == 0) masks.first_places[id] = first_place;
}

/// Looks at the planes across one axis as KdMasks::sweep() does, 32 places at a time.
PACKET_DEVICE void sweep(const KdMaskPlanes::View& masks, const KdSetCell& cell, int axis,
                         KdSearch<KdRange>& search) {
    const auto a = static_cast<std::uint32_t>(axis);
    const std::uint32_t count = masks.place_counts[a * masks.roots + cell.root];
    const KdMaskPlace* const places =
        masks.places + std::size_t{a} * masks.places_an_axis + masks.first_places[cell.root];
    float next_start = cell.bounds.upper[axis];
    for (std::uint32_t done = 0; done < count; done += kWarpSize) {
        // from the last place on
        const std::uint32_t i = done + lane_id();
        const KdMaskPlace place = places[i < count ? count - 1 - i : 0];
        const bool is_of_cell = i < count && place.is_of(cell.set, cell.bounds, axis);
        const bool starts = is_of_cell && (place.starts & cell.set) != 0;
        const unsigned starting = __ballot_sync(kFullWarp, starts);
        const float before = __shfl_sync(kFullWarp, place.position, lane_before(starting));
        const float last = __shfl_sync(kFullWarp, place.position,
                                       starting == 0 ? 0 : 31 - __clz(static_cast<int>(starting)));
        if (is_of_cell) {
            const bool any_before = (starting & lanes_below()) != 0;
            consider_planes(place, cell.set, any_before ? before : next_start, axis, search);
        }
        if (starting != 0) next_start = last;
    }
}

/// A warp a cell.
__global__ void choose_masked_planes(KdLevelView level, KdLimits limits, KdMaskPlanes::View masks,
                                     KdPlane* planes, KdFate* fates) {
    const unsigned id = warp_in_grid();
    if (id >= level.cell_count) return;
    const KdSetCell& cell = level.cells[id];
    KdPlane plane;
    if (cell.count > 1 && cell.depth < limits.max_cut_depth) {
        const KdCost cost(static_cast<const KdRange&>(cell), limits.prices);
        KdSearch<KdRange> search(cell, cost);
        for (int a = 0; a < 3; ++a) sweep(masks, cell, a, search);
        plane = warp_best(search.best, Ascending::kNo);
    }
    if (lane_id() != 0) return;
    planes[id] = plane;
    const bool may_be_leaf = cell.count <= std::max(limits.max_leaf_size, 1u);
    fates[id] = plane.is_cut() ? KdFate::kCut : may_be_leaf ? KdFate::kLeaf : KdFate::kHalved;
}

}  // namespace

void KdBinPlanes::find(const KdDeviceLevel& level, const KdLimits& limits, KdPlane* planes,
                       KdFate* fates, const Stream& stream) {
    const std::uint32_t cells = level.cell_count;
    chunk_counts_.make_room(cells);
    first_chunks_.make_room(cells + 1);
    bins_.make_room(std::size_t{cells} * kWordsOfCell);
    for_each_item(cells, stream, count_chunks, level.view(), chunk_counts_.data());
    prefix_sums_(chunk_counts_.data(), first_chunks_.data(), cells, stream.get());
    for_each_item(std::size_t{cells} * kWordsOfCell, stream, clear_bins, bins_.data(),
                  cells * kWordsOfCell);
    // As many chunks as there can be: how many there are only the device knows.
    const std::uint32_t chunks = level.reference_count / kChunkSize + cells;
    launch(fill_bins, {chunks, kItemThreads, sizeof(std::uint32_t) * kWordsOfCell, stream.get()},
           level.view(), first_chunks_.data(), bins_.data());
    check(cudaGetLastError(), "launch of fill_bins");
    for_each_warp(cells, stream, choose_binned_planes, level.view(), limits, bins_.data(), planes,
                  fates);
}

void KdMaskPlanes::prepare(const KdDeviceLevel& level, const Stream& stream) {
    places_.make_room(std::size_t{6} * level.reference_count);
    place_counts_.make_room(std::size_t{3} * level.cell_count);
    first_places_.make_room(level.cell_count);
    view_ = {places_.data(), place_counts_.data(), first_places_.data(), 2 * level.reference_count,
             level.cell_count};
    for_each_warp(std::size_t{3} * level.cell_count, stream, make_masks, level.view(), view_);
}

void KdMaskPlanes::find(const KdDeviceLevel& level, const KdLimits& limits, KdPlane* planes,
                        KdFate* fates, const Stream& stream) {
    for_each_warp(level.cell_count, stream, choose_masked_planes, level.view(), limits, view_,
                  planes, fates);
}

}  // namespace packet::cuda
