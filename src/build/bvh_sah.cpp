// Splits a node where the expected cost of tracing it is least; where no split pays and the leaf is
// small enough, it is a leaf.
#include "build/bvh_sah.h"

#include "build/object_split.h"
#include "build/split.h"

namespace packet {

namespace {

class SahSplit {
public:
    SahSplit(const BuildOptions& options, const Parallel& parallel)
        : options_(options), parallel_(parallel) {}

    std::optional<Halves> operator()(const NodeRange& node, int depth) const {
        const Binning binning(node.bounds.centroids);
        const ObjectSplit split = find_object_split(node.refs, binning, parallel_);
        if (is_leaf(node, split.cost, options_)) return {};
        return split_objects(node, binning, split, depth, parallel_);
    }

private:
    const BuildOptions& options_;
    const Parallel& parallel_;
};

}  // namespace

Hierarchy build_bvh_sah(AlignedVector<Reference> references, const BuildOptions& options,
                        const Parallel& parallel) {
    return TopDownBuilder(std::move(references), 0, parallel, SahSplit(options, parallel)).build();
}

}  // namespace packet
