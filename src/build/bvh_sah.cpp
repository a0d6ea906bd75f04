// Splits a node where the expected cost of tracing it is least, among the borders of equal bins
// along each axis; where no split pays and the leaf is small enough, it is a leaf.
//
// Wald. On fast construction of SAH-based bounding volume hierarchies. Interactive Ray Tracing
// 2007.
#include "build/bvh_sah.h"

#include "core/views.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace packet {

namespace {

// More bins find slightly better splits (16 to 32: 0.3% less SAH cost) and build slower.
constexpr int kBinCount = 16;
// Below this a task costs more than the work it moves to another core.
constexpr std::size_t kTaskSize = 4096;
// Nodes larger than this are binned by several threads.
constexpr std::size_t kBinGrain = 32768;

using Span = std::span<Reference>;

/// Twice the centroid: the factor cancels in everything it is used for.
glm::vec3 centroid2(const Reference& r) { return r.lower + r.upper; }

/// Maps centroids to bins. Axes along which centroids do not differ enough to be told apart in
/// float have scale 0 and are not split.
struct Binning {
    glm::vec3 origin;
    glm::vec3 scale;

    explicit Binning(const Bounds3f& centroids) : origin(centroids.lower), scale(0.0f) {
        for (int a = 0; a < 3; ++a) {
            const float extent = centroids.upper[a] - centroids.lower[a];
            const float s = static_cast<float>(kBinCount) * 0.999f / extent;
            if (extent > 0.0f && std::isfinite(s)) scale[a] = s;
        }
    }
    [[nodiscard]] int bin(const Reference& r, int axis) const {
        const float x = (r.lower[axis] + r.upper[axis] - origin[axis]) * scale[axis];
        return std::min(static_cast<int>(x), kBinCount - 1);
    }
};

struct Bin {
    Bounds3f bounds;
    std::uint32_t count = 0;

    void add(const Bin& other) {
        bounds.extend(other.bounds);
        count += other.count;
    }
};

using Bins = std::array<std::array<Bin, kBinCount>, 3>;

struct NodeBounds {
    Bounds3f box, centroids;

    void extend(const Reference& r) {
        box.extend(r.bounds());
        centroids.extend(centroid2(r));
    }
    void extend(const NodeBounds& other) {
        box.extend(other.box);
        centroids.extend(other.centroids);
    }
};

struct Split {
    float cost = std::numeric_limits<float>::infinity();
    int axis = -1;
    int bin = 0;  ///< bins below this go first
};

class Builder {
public:
    Builder(AlignedVector<Reference> references, const BuildOptions& options,
            const Parallel& parallel)
        : options_(options), parallel_(parallel), references_(std::move(references)) {
        // A subtree of n references has at most 2n - 1 nodes: its slots are known before its size
        // is.
        if (!references_.empty()) nodes_.resize(2 * references_.size() - 1);
    }

    Hierarchy build() {
        if (!references_.empty()) {
            parallel_.run([&] { build_node(0, references_, measure(references_), 0); });
        }
        return {std::move(nodes_), std::move(references_)};
    }

private:
    /// Folds the references of a large node piecewise, so that several threads share it.
    template <class Result, class Fold, class Join>
    Result fold(Span refs, Fold fold_piece, Join join) const {
        if (refs.size() <= kBinGrain) {
            Result out{};
            fold_piece(out, refs);
            return out;
        }
        std::vector<Result> pieces((refs.size() + kBinGrain - 1) / kBinGrain);
        parallel_.for_pieces(refs.size(), kBinGrain, [&](std::size_t begin, std::size_t end) {
            fold_piece(pieces[begin / kBinGrain], refs.subspan(begin, end - begin));
        });
        for (std::size_t i = 1; i < pieces.size(); ++i) join(pieces[0], pieces[i]);
        return pieces[0];
    }

    NodeBounds measure(Span refs) const {
        return fold<NodeBounds>(
            refs,
            [](NodeBounds& out, Span piece) {
                for (const Reference& r : piece) out.extend(r);
            },
            [](NodeBounds& a, const NodeBounds& b) { a.extend(b); });
    }

    Bins fill_bins(Span refs, const Binning& binning) const {
        return fold<Bins>(
            refs,
            [&](Bins& bins, Span piece) {
                for (const Reference& r : piece) {
                    for (int a = 0; a < 3; ++a) {
                        Bin& bin = bins[static_cast<std::size_t>(a)]
                                       [static_cast<std::size_t>(binning.bin(r, a))];
                        bin.bounds.extend(r.bounds());
                        ++bin.count;
                    }
                }
            },
            [](Bins& a, const Bins& b) {
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    for (std::size_t i = 0; i < kBinCount; ++i) a[axis][i].add(b[axis][i]);
                }
            });
    }

    /// The cheapest border between bins of one axis: a sweep from each side.
    void find_split(const std::array<Bin, kBinCount>& bins, int axis, Split& best) const {
        std::array<float, kBinCount> cost_above{};
        Bin above;
        for (int i = kBinCount - 1; i > 0; --i) {
            above.add(bins[static_cast<std::size_t>(i)]);
            cost_above[static_cast<std::size_t>(i)] =
                above.bounds.half_area() * static_cast<float>(above.count);
        }
        Bin below;
        for (int i = 1; i < kBinCount; ++i) {
            below.add(bins[static_cast<std::size_t>(i) - 1]);
            const float cost = below.bounds.half_area() * static_cast<float>(below.count) +
                               cost_above[static_cast<std::size_t>(i)];
            if (cost < best.cost) best = {cost, axis, i};
        }
    }

    /// A split is allowed if the larger child can still be halved down to one reference within
    /// kMaxDepth. Halving keeps the condition, so by induction no leaf is deeper than that.
    static bool fits_depth(int child_depth, std::size_t larger_child) {
        return child_depth + static_cast<int>(std::bit_width(larger_child - 1)) <= kMaxDepth;
    }

    /// Sorts the references at the best split to both sides; 0 if a leaf is better.
    std::size_t partition(Span refs, const NodeBounds& bounds, int depth) const {
        const bool may_be_leaf = refs.size() <= static_cast<std::size_t>(options_.max_leaf_size);
        const Binning binning(bounds.centroids);
        Split best;
        if (binning.scale != glm::vec3(0.0f)) {
            const Bins bins = fill_bins(refs, binning);
            for (int a = 0; a < 3; ++a) {
                if (binning.scale[a] > 0.0f) find_split(bins[static_cast<std::size_t>(a)], a, best);
            }
        }
        const float area = bounds.box.half_area();
        const float leaf_cost = options_.intersection_cost * area * static_cast<float>(refs.size());
        const float split_cost =
            options_.traversal_cost * area + options_.intersection_cost * best.cost;
        if (may_be_leaf && !(split_cost < leaf_cost)) return 0;
        if (best.axis >= 0) {
            const auto middle = std::partition(refs.begin(), refs.end(), [&](const Reference& r) {
                return binning.bin(r, best.axis) < best.bin;
            });
            const auto first = static_cast<std::size_t>(middle - refs.begin());
            if (first != 0 && first != refs.size() &&
                fits_depth(depth + 1, std::max(first, refs.size() - first))) {
                return first;
            }
        }
        return halve(refs, bounds.centroids);
    }

    /// Equal numbers to both sides, by centroid along the widest axis.
    static std::size_t halve(Span refs, const Bounds3f& centroids) {
        const glm::vec3 extent = centroids.extent();
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0
                         : extent.y >= extent.z                       ? 1
                                                                      : 2;
        const std::size_t half = refs.size() / 2;
        std::nth_element(refs.begin(), refs.begin() + static_cast<std::ptrdiff_t>(half), refs.end(),
                         [axis](const Reference& a, const Reference& b) {
                             const float ca = a.lower[axis] + a.upper[axis];
                             const float cb = b.lower[axis] + b.upper[axis];
                             return ca < cb || (ca == cb && a.id < b.id);
                         });
        return half;
    }

    void build_node(std::size_t slot, Span refs, const NodeBounds& bounds, int depth) {
        BuildNode& node = nodes_[slot];
        node.bounds = bounds.box;
        const std::size_t first = refs.size() == 1 ? 0 : partition(refs, bounds, depth);
        if (first == 0) {
            node.first = static_cast<std::uint32_t>(refs.data() - references_.data());
            node.count = static_cast<std::uint32_t>(refs.size());
            return;
        }
        const std::size_t slot0 = slot + 1, slot1 = slot + 2 * first;
        node.first = static_cast<std::uint32_t>(slot0);
        node.second = static_cast<std::uint32_t>(slot1);
        const Span refs0 = refs.first(first), refs1 = refs.subspan(first);
        const auto build0 = [&] { build_node(slot0, refs0, measure(refs0), depth + 1); };
        const auto build1 = [&] { build_node(slot1, refs1, measure(refs1), depth + 1); };
        if (refs.size() > kTaskSize) {
            parallel_.both(build0, build1);
        } else {
            build0();
            build1();
        }
    }

    const BuildOptions& options_;
    const Parallel& parallel_;
    AlignedVector<Reference> references_;
    std::vector<BuildNode> nodes_;
};

}  // namespace

Hierarchy build_bvh_sah(AlignedVector<Reference> references, const BuildOptions& options,
                        const Parallel& parallel) {
    return Builder(std::move(references), options, parallel).build();
}

}  // namespace packet
