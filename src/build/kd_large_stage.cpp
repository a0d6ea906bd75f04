#include "build/kd_large_stage.h"

#include "build/clip.h"
#include "build/kd_bins.h"
#include "build/kd_cell.h"
#include "build/split.h"
#include "core/macros.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

namespace packet {

namespace {

// References of a chunk: far more than there are bins, few enough that a level of any size keeps
// all threads busy.
constexpr std::size_t kChunkSize = 2048;
// Cells and chunks of a task, which are small on the deep levels.
constexpr std::size_t kGrain = 8;

/// Some references of one cell.
struct Chunk {
    std::size_t cell;
    std::size_t first, last;
    std::size_t count[2] = {0, 0};  ///< that go to each side
    std::size_t cut_count = 0;      ///< of these, how many go to both sides
    std::size_t first_cut = 0;
    std::size_t place[2] = {0, 0};  ///< of the first one of each side, in the array it goes to
    std::array<Bounds3f, 2> bounds = {};  ///< of what goes to each side
};

/// A cell of the level, while it is cut.
struct Cut {
    KdPlane plane;
    std::size_t first_chunk = 0, last_chunk = 0;
    std::size_t first_bins = 0;  ///< of its chunks, if they are several
    KdRange child[2];
};

/// Cuts levels of large cells. Arrays keep their memory from level to level: to clear pages of new
/// memory takes as long as a pass.
class LargeStage {
public:
    LargeStage(MeshView mesh, KdLevel root, const BuildOptions& options, const Parallel& parallel)
        : mesh_(mesh),
          options_(options),
          parallel_(parallel),
          max_cut_depth_(max_cut_depth(root.references.size())),
          level_(std::move(root)) {
        out_.nodes.push_back({});
    }

    [[nodiscard]] bool is_done() const { return level_.cells.empty(); }
    [[nodiscard]] KdLargeStage take() && { return std::move(out_); }

    void cut_level() {
        make_chunks();
        find_planes();
        for_chunks([&](Chunk& chunk) { mark(chunk); });
        for_cells([&](std::size_t cell) { halve_if_needed(cell); });
        count_cuts();
        for_chunks([&](Chunk& chunk) { clip(chunk); });
        KdLevel small;
        place_children(small);
        for_chunks([&](Chunk& chunk) { move(chunk, small); });
        link_children(small);
        if (!small.cells.empty()) out_.small.push_back(std::move(small));
        std::swap(level_, next_);
    }

private:
    template <class Fn>
    void for_chunks(Fn fn) {
        parallel_.for_pieces(chunks_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) fn(chunks_[i]);
        });
    }
    template <class Fn>
    void for_cells(Fn fn) {
        parallel_.for_pieces(cuts_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) fn(i);
        });
    }
    [[nodiscard]] std::span<Chunk> chunks_of(std::size_t cell) {
        const Cut& cut = cuts_[cell];
        return std::span(chunks_).subspan(cut.first_chunk, cut.last_chunk - cut.first_chunk);
    }

    void make_chunks() {
        cuts_.assign(level_.cells.size(), {});
        chunks_.clear();
        std::size_t bins = 0;
        for (std::size_t cell = 0; cell < cuts_.size(); ++cell) {
            cuts_[cell].first_chunk = chunks_.size();
            const std::size_t end = level_.cells[cell].first + level_.cells[cell].count;
            for (std::size_t i = level_.cells[cell].first; i < end; i += kChunkSize) {
                chunks_.push_back({cell, i, std::min(end, i + kChunkSize)});
            }
            cuts_[cell].last_chunk = chunks_.size();
            cuts_[cell].first_bins = bins;
            if (chunks_of(cell).size() > 1) bins += chunks_of(cell).size();
        }
        bins_.clear();
        bins_.resize(bins);
        sides_.clear();
        sides_.resize(level_.references.size());
    }

    void find_planes() {
        for_chunks([&](const Chunk& chunk) {
            KdBins bins;
            bins.add(level_.cells[chunk.cell].bounds,
                     std::span(level_.references).subspan(chunk.first, chunk.last - chunk.first));
            const std::span<Chunk> chunks = chunks_of(chunk.cell);
            if (chunks.size() == 1) {
                find_plane(chunk.cell, bins);
            } else {
                const auto index = static_cast<std::size_t>(&chunk - chunks.data());
                bins_[cuts_[chunk.cell].first_bins + index] = bins;
            }
        });
        for_cells([&](std::size_t cell) {
            const std::size_t count = chunks_of(cell).size();
            if (count == 1) return;
            KdBins* const bins = bins_.data() + cuts_[cell].first_bins;
            for (std::size_t i = 1; i < count; ++i) bins[0].join(bins[i]);
            find_plane(cell, bins[0]);
        });
    }
    void find_plane(std::size_t i, const KdBins& bins) {
        const KdRange& cell = level_.cells[i];
        if (cell.depth < max_cut_depth_) cuts_[i].plane = find_cheapest_plane(bins, cell, options_);
    }

    void mark(Chunk& chunk) {
        const KdPlane& plane = cuts_[chunk.cell].plane;
        if (!plane.is_cut()) return;
        for (std::size_t i = chunk.first; i < chunk.last; ++i) {
            const int side = plane.side_of(level_.references[i]);
            sides_[i] = static_cast<std::uint8_t>(side);
        }
        count(chunk);
    }
    void count(Chunk& chunk) {
        std::size_t counts[3] = {0, 0, 0};
        for (std::size_t i = chunk.first; i < chunk.last; ++i) ++counts[sides_[i]];
        for (std::size_t s = 0; s < 2; ++s) chunk.count[s] = counts[s] + counts[kBothSides];
        chunk.cut_count = counts[kBothSides];
    }

    /// What no plane parts, or would lead too deep, is parted without being cut.
    void halve_if_needed(std::size_t i) {
        const KdRange& cell = level_.cells[i];
        std::size_t counts[2] = {0, 0};
        for (const Chunk& chunk : chunks_of(i)) {
            for (std::size_t s = 0; s < 2; ++s) counts[s] += chunk.count[s];
        }
        const bool is_cut = cuts_[i].plane.is_cut();
        if (is_cut && fits_depth(cell.depth + 1, std::max(counts[0], counts[1]))) return;
        cuts_[i].plane = {};
        const std::vector<std::uint8_t> sides =
            sides_of_halves(level_.references_of(cell), cell.bounds);
        std::copy(sides.begin(), sides.end(),
                  sides_.begin() + static_cast<std::ptrdiff_t>(cell.first));
        for (Chunk& chunk : chunks_of(i)) count(chunk);
    }

    void count_cuts() {
        std::size_t count = 0;
        for (Chunk& chunk : chunks_) {
            chunk.first_cut = count;
            count += chunk.cut_count;
        }
        parts_.clear();
        parts_.resize(count);
    }

    void clip(Chunk& chunk) {
        const KdPlane& plane = cuts_[chunk.cell].plane;
        CutReference* part = parts_.data() + chunk.first_cut;
        for (std::size_t i = chunk.first; i < chunk.last; ++i) {
            if (sides_[i] != kBothSides) continue;
            *part = cut_reference(mesh_, level_.references[i], plane.axis, plane.position);
            for (std::size_t s = 0; s < 2; ++s) chunk.count[s] -= part->side[s].bounds().empty();
            ++part;
        }
    }

    /// Where each chunk's references go: those of a child are one range.
    void place_children(KdLevel& small) {
        std::size_t next_count = 0, small_count = 0;
        for (std::size_t i = 0; i < cuts_.size(); ++i) {
            const KdRange& cell = level_.cells[i];
            auto& child = cuts_[i].child;
            for (std::size_t s = 0; s < 2; ++s) {
                for (const Chunk& chunk : chunks_of(i)) child[s].count += chunk.count[s];
                std::size_t& end = is_small(child[s]) ? small_count : next_count;
                child[s].first = end;
                child[s].depth = cell.depth + 1;
                for (Chunk& chunk : chunks_of(i)) {
                    chunk.place[s] = end;
                    end += chunk.count[s];
                }
            }
            share_out<KdRange>(cell, child);
        }
        next_.references.clear();
        next_.references.resize(next_count);
        small.references.resize(small_count);
    }
    static bool is_small(const KdRange& cell) { return cell.count <= kMaxSmallCell; }

    void move(Chunk& chunk, KdLevel& small) {
        Reference* to[2];
        for (std::size_t s = 0; s < 2; ++s) {
            KdLevel& level = is_small(cuts_[chunk.cell].child[s]) ? small : next_;
            to[s] = level.references.data() + chunk.place[s];
        }
        const auto put = [&](std::size_t s, const Reference& r) {
            *to[s]++ = r;
            chunk.bounds[s].extend(r.bounds());
        };
        const CutReference* part = parts_.data() + chunk.first_cut;
        for (std::size_t i = chunk.first; i < chunk.last; ++i) {
            if (sides_[i] != kBothSides) {
                put(sides_[i], level_.references[i]);
                continue;
            }
            for (std::size_t s = 0; s < 2; ++s) {
                if (!part->side[s].bounds().empty()) put(s, part->side[s]);
            }
            ++part;
        }
    }

    void link_children(KdLevel& small) {
        ScratchVector<BuildNode>& nodes = out_.nodes;
        next_.cells.clear();
        for (std::size_t i = 0; i < cuts_.size(); ++i) {
            auto& child = cuts_[i].child;
            for (const Chunk& chunk : chunks_of(i)) {
                for (std::size_t s = 0; s < 2; ++s) child[s].bounds.extend(chunk.bounds[s]);
            }
            const std::uint32_t node = level_.cells[i].node;
            const bool has_two = child[0].count != 0 && child[1].count != 0;
            if (has_two) {
                const auto first = static_cast<std::uint32_t>(nodes.size());
                nodes[node].bounds = level_.cells[i].bounds;
                nodes[node].first = first;
                nodes[node].second = first + 1;
                nodes.insert(nodes.end(), 2, BuildNode{});
            }
            for (std::size_t s = 0; s < 2; ++s) {
                if (child[s].count == 0) continue;
                // A node of one child is that child.
                child[s].node = has_two ? nodes[node].child(static_cast<int>(s)) : node;
                (is_small(child[s]) ? small : next_).cells.push_back(child[s]);
            }
        }
    }

    MeshView mesh_;
    const BuildOptions& options_;
    const Parallel& parallel_;
    int max_cut_depth_;
    KdLevel level_, next_;
    KdLargeStage out_;
    // Of the level:
    std::vector<Cut> cuts_;
    std::vector<Chunk> chunks_;
    ScratchVector<KdBins> bins_;
    ScratchVector<std::uint8_t> sides_;  ///< where each reference goes
    ScratchVector<CutReference> parts_;  ///< of those that go to both sides
};

}  // namespace

KdLargeStage run_large_stage(MeshView mesh, KdLevel root, const BuildOptions& options,
                             const Parallel& parallel, double share) {
    const std::size_t count = root.references.size();
    if (count <= kMaxSmallCell) {
        KdLargeStage out;
        out.nodes.push_back({});
        out.small.push_back(std::move(root));
        parallel.advance(share);
        return out;
    }
    // There are often more, of few cells.
    const auto levels = static_cast<double>(std::bit_width(count / kMaxSmallCell));
    double left = share;
    for (LargeStage stage(mesh, std::move(root), options, parallel);;) {
        stage.cut_level();
        const double part = stage.is_done() ? left : std::min(left, share / levels);
        left -= part;
        parallel.advance(part);
        if (stage.is_done()) return std::move(stage).take();
    }
}

}  // namespace packet
