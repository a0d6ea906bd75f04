// Splits a node where the expected cost of tracing it is least, among the borders of equal bins
// along each axis; where no split pays and the leaf is small enough, it is a leaf.
//
// Wald. On fast construction of SAH-based bounding volume hierarchies. Interactive Ray Tracing
// 2007.
#include "build/bvh_sah.h"

#include "build/split.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace packet {

namespace {

// More bins find slightly better splits (16 to 32: 0.3% less SAH cost) and build slower.
constexpr int kBinCount = 16;

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

struct Split {
    float cost = std::numeric_limits<float>::infinity();
    int axis = -1;
    int bin = 0;  ///< bins below this go first
};

Bins fill_bins(ReferenceSpan refs, const Binning& binning, const Parallel& parallel) {
    return fold_references<Bins>(
        refs, parallel,
        [&](Bins& bins, ReferenceSpan piece) {
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
void find_split(const std::array<Bin, kBinCount>& bins, int axis, Split& best) {
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

/// Splits at the best border of bins; 0 if a leaf is better.
class SahSplit {
public:
    SahSplit(const BuildOptions& options, const Parallel& parallel)
        : options_(options), parallel_(parallel) {}

    std::size_t operator()(ReferenceSpan refs, const NodeBounds& bounds, int depth) const {
        const bool may_be_leaf = refs.size() <= static_cast<std::size_t>(options_.max_leaf_size);
        const Binning binning(bounds.centroids);
        Split best;
        if (binning.scale != glm::vec3(0.0f)) {
            const Bins bins = fill_bins(refs, binning, parallel_);
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
            if (is_allowed(first, refs.size(), depth)) return first;
        }
        return halve(refs, bounds.centroids);
    }

private:
    const BuildOptions& options_;
    const Parallel& parallel_;
};

}  // namespace

Hierarchy build_bvh_sah(AlignedVector<Reference> references, const BuildOptions& options,
                        const Parallel& parallel) {
    return TopDownBuilder(std::move(references), parallel, SahSplit(options, parallel)).build();
}

}  // namespace packet
