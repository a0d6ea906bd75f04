// References are found in pieces of the triangles, sorted by groups of cells, and in each group by
// cell: a counting sort in two steps, so that counters and lists stay in the cache. Both steps are
// stable, so triangles keep their order.
//
// Lagae, Dutre. Compact, fast and robust grids for ray tracing. CGF 2008 (counting sort).
// Ize, Wald, Robertson, Parker. An evaluation of parallel grid construction for ray tracing dynamic
// scenes. Interactive Ray Tracing 2006.
#include "build/grid_references.h"

#include "dispatch/dispatch.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <span>
#include <utility>

namespace packet {

namespace {

// Some 300 us of work, and few enough pieces for a table of counts by piece and group.
constexpr std::size_t kGrain = 8192;
// Of the time that a grid takes, about; laying it out is the rest.
constexpr double kShareOfOverlaps = 0.5, kShareOfSort = 0.2;
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
        : mesh_(mesh), space_(space), overlap8_(select_kernels({}).overlap_axes8), out_(out) {}

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

    /// Up to eight boxes, waiting for a test. What is in the other lanes does not matter.
    struct Boxes {
        float lower[3][8] = {}, upper[3][8] = {};
        std::uint32_t count = 0;

        void push(const Bounds3f& box) {
            for (int a = 0; a < 3; ++a) {
                lower[a][count] = box.lower[a];
                upper[a][count] = box.upper[a];
            }
            ++count;
        }
    };
    [[nodiscard]] std::uint32_t test(const Boxes& boxes) const {
        return overlap8_(triangle_, boxes.lower, boxes.upper) & ((1u << boxes.count) - 1);
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
                    if (waiting_.count == 8) flush();
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
    KernelTable::Overlap8 overlap8_;
    std::vector<CellReference>& out_;
    std::uint32_t id_ = 0;
    float triangle_[3][3] = {};
    Boxes waiting_;
    std::uint32_t waiting_cell_[8] = {};
};

using Pieces = std::vector<std::vector<CellReference>>;

/// The references of all triangles, by piece; fewer pieces if they come to more than `limit`.
Pieces find_references(MeshView mesh, const GridSpace& space,
                       const ScratchVector<Reference>& references, std::size_t limit,
                       const Parallel& parallel) {
    Pieces pieces((references.size() + kGrain - 1) / kGrain);
    std::atomic<std::size_t> total = 0;
    parallel.for_pieces(references.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        std::vector<CellReference>& out = pieces[begin / kGrain];
        out.reserve(2 * (end - begin));
        OverlapFinder finder(mesh, space, out);
        for (std::size_t i = begin; i < end && total + out.size() <= limit; ++i) {
            finder.add(references[i]);
        }
        total += out.size();
        parallel.advance(kShareOfOverlaps * static_cast<double>(end - begin) /
                         static_cast<double>(references.size()));
    });
    if (total > limit) pieces.clear();
    return pieces;
}

/// Groups of neighbouring cells: those whose numbers differ only in the low bits.
struct Groups {
    int shift;
    std::size_t count;

    explicit Groups(std::size_t cell_numbers)
        : shift(std::max(6, static_cast<int>(std::bit_width((cell_numbers - 1) / kMostGroups)))),
          count(((cell_numbers - 1) >> shift) + 1) {}
    [[nodiscard]] std::size_t group_of(std::uint32_t cell) const { return cell >> shift; }
    [[nodiscard]] std::size_t cells() const { return std::size_t{1} << shift; }
};

/// References sorted by group. Those of group g end at ends[g] and begin where the last one's end.
struct Grouped {
    ScratchVector<CellReference> references;
    std::vector<std::uint32_t> ends;
};

Grouped sort_by_group(Pieces pieces, const Groups& groups, const Parallel& parallel) {
    std::vector<std::vector<std::uint32_t>> places(pieces.size());
    parallel.for_pieces(pieces.size(), 1, [&](std::size_t p, std::size_t) {
        places[p].resize(groups.count);
        for (const CellReference& r : pieces[p]) ++places[p][groups.group_of(r.cell)];
        parallel.advance(kShareOfSort / 3.0 / static_cast<double>(pieces.size()));
    });
    Grouped out;
    std::uint32_t place = 0;
    for (std::size_t g = 0; g < groups.count; ++g) {
        for (auto& counts : places) place += std::exchange(counts[g], place);
        out.ends.push_back(place);
    }
    out.references.resize(place);
    parallel.for_pieces(pieces.size(), 1, [&](std::size_t p, std::size_t) {
        for (const CellReference& r : pieces[p]) {
            out.references[places[p][groups.group_of(r.cell)]++] = r;
        }
        pieces[p] = {};
        parallel.advance(kShareOfSort / 3.0 / static_cast<double>(pieces.size()));
    });
    return out;
}

/// Sorts the references of one group, from `first` on, by cell. Returns the cells that have any.
std::vector<CellList> sort_group(std::span<const CellReference> references, std::uint32_t first,
                                 std::size_t cells, std::span<std::uint32_t> ids) {
    std::vector<CellList> lists;
    if (references.empty()) return lists;
    const auto low = [&](std::uint32_t cell) { return cell & (cells - 1); };
    const auto base = static_cast<std::uint32_t>(references[0].cell & ~(cells - 1));
    std::vector<std::uint32_t> places(cells);
    for (const CellReference& r : references) ++places[low(r.cell)];
    std::uint32_t place = 0;
    for (std::size_t c = 0; c < cells; ++c) {
        const std::uint32_t count = places[c];
        if (count != 0)
            lists.push_back({base + static_cast<std::uint32_t>(c), first + place, count});
        places[c] = place;
        place += count;
    }
    for (const CellReference& r : references) ids[places[low(r.cell)]++] = r.id;
    return lists;
}

}  // namespace

CellLists sort_into_cells(MeshView mesh, const ScratchVector<Reference>& references,
                          double cells_per_triangle, const BuildOptions& options,
                          const Parallel& parallel) {
    Bounds3f bounds;
    for (const Reference& r : references) bounds.extend(r.bounds());
    const auto n = static_cast<double>(references.size());
    const auto limit =
        static_cast<std::size_t>(std::min(n * static_cast<double>(options.max_reference_factor),
                                          static_cast<double>(kMostReferences)));
    double cell_count = std::max(1.0, n * cells_per_triangle);
    CellLists out{GridSpace(bounds, cell_count), {}, {}};
    Pieces pieces = find_references(mesh, out.space, references, limit, parallel);
    // One cell refers to each triangle once, so this ends.
    while (pieces.empty()) {
        cell_count = std::max(1.0, 0.5 * cell_count);
        out.space = GridSpace(bounds, cell_count);
        pieces = find_references(mesh, out.space, references, limit, parallel);
    }
    const Groups groups(64 * out.space.brick_count());
    const Grouped grouped = sort_by_group(std::move(pieces), groups, parallel);
    out.ids.resize(grouped.references.size());
    std::vector<std::vector<CellList>> lists(groups.count);
    parallel.for_pieces(groups.count, 1, [&](std::size_t g, std::size_t) {
        const std::uint32_t first = g == 0 ? 0 : grouped.ends[g - 1];
        const std::size_t count = grouped.ends[g] - first;
        lists[g] = sort_group(std::span(grouped.references).subspan(first, count), first,
                              groups.cells(), std::span(out.ids).subspan(first, count));
        parallel.advance(kShareOfSort / 3.0 / static_cast<double>(groups.count));
    });
    for (const auto& part : lists) out.lists.insert(out.lists.end(), part.begin(), part.end());
    return out;
}

}  // namespace packet
