// Variance, not extent, chooses the axis: a few stray triangles widen a node's bounds, but hardly
// its variance.
//
// Kay, Kajiya. Ray tracing complex scenes. SIGGRAPH 1986, for splitting centroids top down.
// White, Jain. Similarity indexing with the SS-tree. ICDE 1996, for the axis of most variance.
#include "build/bvh_midpoint.h"

#include "build/split.h"

#include <algorithm>

namespace packet {

namespace {

/// Sums over doubled centroids, relative to an origin near them so that little cancels. In double:
/// squares of the largest coordinates do not overflow, nor do those of the smallest vanish.
struct Moments {
    glm::dvec3 sum{0.0};
    glm::dvec3 sum_of_squares{0.0};
    double count = 0.0;

    void add(const glm::dvec3& x) {
        sum += x;
        sum_of_squares += x * x;
        count += 1.0;
    }
    void add(const Moments& other) {
        sum += other.sum;
        sum_of_squares += other.sum_of_squares;
        count += other.count;
    }
    /// Count times the variance.
    [[nodiscard]] glm::dvec3 spread() const { return sum_of_squares - sum * sum / count; }
};

int axis_of_greatest_variance(ReferenceSpan refs, const glm::vec3& origin,
                              const Parallel& parallel) {
    const auto moments = fold_references<Moments>(
        refs, parallel,
        [&](Moments& out, ReferenceSpan piece) {
            for (const Reference& r : piece) out.add(glm::dvec3(centroid2(r)) - glm::dvec3(origin));
        },
        [](Moments& a, const Moments& b) { a.add(b); });
    const glm::dvec3 spread = moments.spread();
    if (spread.x >= spread.y && spread.x >= spread.z) return 0;
    return spread.y >= spread.z ? 1 : 2;
}

class MidpointSplit {
public:
    MidpointSplit(const BuildOptions& options, const Parallel& parallel)
        : max_leaf_size_(static_cast<std::size_t>(options.max_leaf_size)), parallel_(parallel) {}

    std::optional<Halves> operator()(const NodeRange& node, int depth) const {
        const ReferenceSpan refs = node.refs;
        if (refs.size() <= max_leaf_size_) return {};
        const glm::vec3 middle = node.bounds.centroids.center();
        const int axis = axis_of_greatest_variance(refs, middle, parallel_);
        const auto second = std::partition(refs.begin(), refs.end(), [&](const Reference& r) {
            return centroid2(r)[axis] < middle[axis];
        });
        auto first = static_cast<std::size_t>(second - refs.begin());
        if (!is_allowed(first, refs.size(), depth)) first = halve(node);
        return divide(node, first, parallel_);
    }

private:
    std::size_t max_leaf_size_;
    const Parallel& parallel_;
};

}  // namespace

Hierarchy build_bvh_midpoint(ScratchVector<Reference> references, const BuildOptions& options,
                             const Parallel& parallel) {
    return TopDownBuilder(std::move(references), 0, parallel, MidpointSplit(options, parallel))
        .build();
}

}  // namespace packet
