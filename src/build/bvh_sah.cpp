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
        : costs_(options), parallel_(parallel) {}

    std::optional<Halves> operator()(const NodeRange& node, int depth) const {
        if (is_surely_leaf(node, costs_)) return {};
        const ObjectSplit split = find_object_split(node, costs_, parallel_, SplitSearch::kSampled);
        if (is_leaf(node, split.cost, costs_)) return {};
        return split_objects(node, split, depth, parallel_);
    }

private:
    SahCosts costs_;
    const Parallel& parallel_;
};

}  // namespace

Hierarchy build_bvh_sah(ScratchVector<Reference> references, const BuildOptions& options,
                        const Parallel& parallel) {
    return TopDownBuilder(std::move(references), 0, parallel, SahSplit(options, parallel)).build();
}

}  // namespace packet
