// References are found in pieces of the triangles; a piece's are sorted by groups of cells, and a
// group's, of all pieces, by cell: a counting sort in two steps, so that counters and lists stay in
// the cache. Both steps are stable, so triangles keep their order.
//
// Lagae, Dutre. Compact, fast and robust grids for ray tracing. CGF 2008 (counting sort).
// Ize, Wald, Robertson, Parker. An evaluation of parallel grid construction for ray tracing dynamic
// scenes. Interactive Ray Tracing 2006.
#include "build/grid_references.h"

#include "build/lane_box.h"
#include "dispatch/dispatch.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <optional>
#include <span>
#include <utility>

namespace packet {

namespace {

// Some 300 us of work, and few enough pieces for a table of counts by piece and group.
constexpr std::size_t kGrain = 8192;
// One triangle in so many is a sample, where these are enough to tell within 1% or 2%.
constexpr std::size_t kSampleStep = 32, kFewestSampled = 65536;
// Of the time that a grid takes, about; laying it out is the rest.
constexpr double kShareOfOverlaps = 0.6, kShareOfSort = 0.1;
// Groups of cells, at most: each has a place in memory that is written to, a page of its own.
constexpr std::size_t kMostGroups = 512;
// References are named by 31 bits.
constexpr std::size_t kMostReferences = (std::size_t{1} << 31) - 1;

struct CellReference {
    std::uint32_t cell, id;
};

/// Finds the cells that triangles overlap.
class OverlapFinder {
public:
    OverlapFinder(MeshView mesh, const GridSpace& space, std::vector<CellReference>& out)
        : mesh_(mesh), space_(space), overlap_(select_kernels({}).overlap_axes), out_(out) {}

    void add(const Reference& reference) {
        id_ = reference.id;
        const CellRange range = space_.range_of(reference.bounds());
        // The triangle has points at both ends of its box and at all places in between.
        if (range.is_row()) {
            add_all(range);
            return;
        }
        const glm::uvec3 corners = mesh_.triangles[id_];
        for (int k = 0; k < 3; ++k) {
            for (int a = 0; a < 3; ++a) triangle_[k][a] = mesh_.positions[corners[k]][a];
        }
        add_overlapping(range);
        flush();
    }

private:
    // More cells at once than this are first halved along each axis, and so on: then what is far
    // from the triangle costs a test of its own only rarely. From 16 to 64 speeds differ by 3%.
    static constexpr std::size_t kMostAtOnce = 32;

    void put(const CellRange& cell) {
        out_.push_back({space_.cell_id(cell.first[0], cell.first[1], cell.first[2]), id_});
    }
    void add_all(const CellRange& range) {
        for (int z = range.first[2]; z <= range.last[2]; ++z) {
            for (int y = range.first[1]; y <= range.last[1]; ++y) {
                for (int x = range.first[0]; x <= range.last[0]; ++x) {
                    out_.push_back({space_.cell_id(x, y, z), id_});
                }
            }
        }
    }

    /// Boxes that wait for a test. What is in the other lanes does not matter.
    struct Boxes {
        static constexpr int kMost = 32;
        float lower[3][kMost] = {}, upper[3][kMost] = {};
        int count = 0;

        void push(const Bounds3f& box) {
            for (int a = 0; a < 3; ++a) {
                lower[a][count] = box.lower[a];
                upper[a][count] = box.upper[a];
            }
            ++count;
        }
    };
    [[nodiscard]] std::uint32_t test(const Boxes& boxes) const {
        return overlap_(triangle_, boxes.lower, boxes.upper, boxes.count);
    }
    void add_overlapping(const CellRange& range) {
        if (range.count() > kMostAtOnce) {
            split(range);
            return;
        }
        for (int z = range.first[2]; z <= range.last[2]; ++z) {
            for (int y = range.first[1]; y <= range.last[1]; ++y) {
                for (int x = range.first[0]; x <= range.last[0]; ++x) {
                    waiting_cell_[waiting_.count] = space_.cell_id(x, y, z);
                    waiting_.push(space_.box_of({{x, y, z}, {x, y, z}}));
                    if (waiting_.count == Boxes::kMost) flush();
                }
            }
        }
    }
    /// Tests the cells that wait, of all parts of the triangle's range.
    void flush() {
        if (waiting_.count == 0) return;
        for (std::uint32_t bits = test(waiting_); bits != 0; bits &= bits - 1) {
            out_.push_back({waiting_cell_[std::countr_zero(bits)], id_});
        }
        waiting_.count = 0;
    }
    void split(const CellRange& range) {
        CellRange parts[8];
        Boxes boxes;
        for (int i = 0; i < 8; ++i) {
            CellRange part = range;
            bool is_empty = false;
            for (int a = 0; a < 3; ++a) {
                const int middle = range.first[a] + (range.side(a) - 1) / 2;
                (i >> a & 1 ? part.first[a] : part.last[a]) = i >> a & 1 ? middle + 1 : middle;
                is_empty |= part.first[a] > part.last[a];
            }
            if (is_empty) continue;
            parts[boxes.count] = part;
            boxes.push(space_.box_of(part));
        }
        for (std::uint32_t bits = test(boxes); bits != 0; bits &= bits - 1) {
            const CellRange& part = parts[std::countr_zero(bits)];
            if (part.count() == 1) {
                put(part);
            } else {
                add_overlapping(part);
            }
        }
    }

    MeshView mesh_;
    const GridSpace& space_;
    KernelTable::Overlap overlap_;
    std::vector<CellReference>& out_;
    std::uint32_t id_ = 0;
    float triangle_[3][3] = {};
    Boxes waiting_;
    std::uint32_t waiting_cell_[Boxes::kMost] = {};
};

/// Groups of neighbouring cells: those whose numbers differ only in the low bits.
struct Groups {
    int shift;
    std::size_t count;

    explicit Groups(const GridSpace& space) {
        const std::size_t highest = space.cell_id_end() - 1;
        shift = std::max(6, static_cast<int>(std::bit_width(highest / kMostGroups)));
        count = (highest >> shift) + 1;
    }
    [[nodiscard]] std::size_t group_of(std::uint32_t cell) const { return cell >> shift; }
    [[nodiscard]] std::size_t cells() const { return std::size_t{1} << shift; }
};

/// References of pieces of the triangles. A piece's lie together, sorted by group.
struct GroupedReferences {
    ScratchVector<CellReference> items;
    /// By piece: where its first group begins in the items, and where each ends.
    std::vector<std::vector<std::uint32_t>> ends;

    [[nodiscard]] std::span<const CellReference> run(std::size_t piece, std::size_t group) const {
        const std::uint32_t begin = ends[piece][group], end = ends[piece][group + 1];
        return std::span(items).subspan(begin, end - begin);
    }
};

Bounds3f bounds_of(const ScratchVector<Reference>& references, const Parallel& parallel) {
    std::vector<Bounds3f> of_pieces((references.size() + kGrain - 1) / kGrain);
    parallel.for_pieces(references.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        LaneBox box;
        for (std::size_t i = begin; i < end; ++i) box.extend(lane_box(references[i]));
        of_pieces[begin / kGrain] = box.bounds();
    });
    Bounds3f out;
    for (const Bounds3f& piece : of_pieces) out.extend(piece);
    return out;
}

/// Whether every so manyth triangle tells that there are more than `limit` references.
bool seem_to_exceed(double limit, MeshView mesh, const GridSpace& space,
                    const ScratchVector<Reference>& references, const Parallel& parallel) {
    const std::size_t samples = references.size() / kSampleStep;
    const auto most = static_cast<std::size_t>(limit * static_cast<double>(samples) /
                                               static_cast<double>(references.size()));
    std::atomic<std::size_t> total = 0;
    parallel.for_pieces(samples, kGrain / kSampleStep, [&](std::size_t begin, std::size_t end) {
        std::vector<CellReference> found;
        OverlapFinder finder(mesh, space, found);
        for (std::size_t i = begin; i < end && total + found.size() <= most; ++i) {
            finder.add(references[i * kSampleStep]);
        }
        total += found.size();
    });
    return total > most;
}

/// Sorts a piece's references by group to their places in `out` from `begin` on. Returns `begin`
/// and where each group ends.
std::vector<std::uint32_t> sort_by_group(std::span<const CellReference> references,
                                         const Groups& groups, std::size_t begin,
                                         ScratchVector<CellReference>& out) {
    std::vector<std::uint32_t> ends(groups.count + 2);
    for (const CellReference& r : references) ++ends[groups.group_of(r.cell) + 2];
    ends[0] = ends[1] = static_cast<std::uint32_t>(begin);
    for (std::size_t g = 2; g < ends.size(); ++g) ends[g] += ends[g - 1];
    for (const CellReference& r : references) out[ends[groups.group_of(r.cell) + 1]++] = r;
    ends.pop_back();
    return ends;
}

/// The references of all triangles, or none if they come to more than `limit`.
std::optional<GroupedReferences> find_references(MeshView mesh, const GridSpace& space,
                                                 const ScratchVector<Reference>& references,
                                                 std::size_t limit, const Parallel& parallel) {
    const Groups groups(space);
    GroupedReferences out;
    out.items.resize(limit);  // what is not written to takes no memory
    out.ends.resize((references.size() + kGrain - 1) / kGrain);
    std::atomic<std::size_t> total = 0;
    tbb::enumerable_thread_specific<std::vector<CellReference>> buffers;
    parallel.for_pieces(references.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        std::vector<CellReference>& found = buffers.local();
        found.clear();
        OverlapFinder finder(mesh, space, found);
        for (std::size_t i = begin; i < end && total + found.size() <= limit; ++i) {
            finder.add(references[i]);
        }
        const std::size_t first = total.fetch_add(found.size());
        if (first + found.size() > limit) return;
        out.ends[begin / kGrain] = sort_by_group(found, groups, first, out.items);
        parallel.advance(kShareOfOverlaps * static_cast<double>(end - begin) /
                         static_cast<double>(references.size()));
    });
    if (total > limit) return std::nullopt;
    return out;
}

/// Sorts the references of one group by cell. Returns the cells that have any; their ids are put
/// from `first` on.
std::vector<CellList> sort_by_cell(const GroupedReferences& references, std::size_t group,
                                   const Groups& groups, std::uint32_t first,
                                   ScratchVector<std::uint32_t>& ids) {
    const std::size_t pieces = references.ends.size();
    const auto low = [&](std::uint32_t cell) { return cell & (groups.cells() - 1); };
    std::vector<std::uint32_t> places(groups.cells());
    for (std::size_t p = 0; p < pieces; ++p) {
        for (const CellReference& r : references.run(p, group)) ++places[low(r.cell)];
    }
    std::vector<CellList> lists;
    for (std::size_t c = 0; c < places.size(); ++c) {
        const std::uint32_t count = std::exchange(places[c], first);
        const auto cell = static_cast<std::uint32_t>((group << groups.shift) + c);
        if (count != 0) lists.push_back({cell, first, count});
        first += count;
    }
    for (std::size_t p = 0; p < pieces; ++p) {
        for (const CellReference& r : references.run(p, group)) ids[places[low(r.cell)]++] = r.id;
    }
    return lists;
}

/// Where each group's references begin, and the number of all.
std::vector<std::uint32_t> group_begins(const GroupedReferences& references, std::size_t groups) {
    std::vector<std::uint32_t> begins(groups + 1);
    for (std::size_t g = 0; g < groups; ++g) {
        begins[g + 1] = begins[g];
        for (std::size_t p = 0; p < references.ends.size(); ++p) {
            begins[g + 1] += static_cast<std::uint32_t>(references.run(p, g).size());
        }
    }
    return begins;
}

CellLists sort_by_cell(const GroupedReferences& references, GridSpace space,
                       const Parallel& parallel) {
    const Groups groups(space);
    const std::vector<std::uint32_t> begins = group_begins(references, groups.count);
    CellLists out{std::move(space), {}, {}};
    out.ids.resize(begins.back());
    std::vector<std::vector<CellList>> lists(groups.count);
    parallel.for_pieces(groups.count, 1, [&](std::size_t g, std::size_t) {
        if (begins[g] != begins[g + 1]) {
            lists[g] = sort_by_cell(references, g, groups, begins[g], out.ids);
        }
        parallel.advance(kShareOfSort / static_cast<double>(groups.count));
    });
    for (const auto& part : lists) out.lists.insert(out.lists.end(), part.begin(), part.end());
    return out;
}

}  // namespace

CellLists sort_into_cells(MeshView mesh, const ScratchVector<Reference>& references,
                          double cells_per_triangle, const BuildOptions& options,
                          const Parallel& parallel) {
    const Bounds3f bounds = bounds_of(references, parallel);
    const auto n = static_cast<double>(references.size());
    const double limit = std::min(n * static_cast<double>(options.max_reference_factor),
                                  static_cast<double>(kMostReferences));
    double cell_count = std::max(1.0, n * cells_per_triangle);
    // One cell refers to each triangle once, so this ends.
    for (;; cell_count = std::max(1.0, 0.5 * cell_count)) {
        GridSpace space(bounds, cell_count);
        // Where a sample tells that there are too many there is no need to find them all.
        if (references.size() >= kFewestSampled && space.cell_count() > 1 &&
            seem_to_exceed(limit, mesh, space, references, parallel)) {
            continue;
        }
        const auto found =
            find_references(mesh, space, references, static_cast<std::size_t>(limit), parallel);
        if (found) return sort_by_cell(*found, std::move(space), parallel);
    }
}

}  // namespace packet
