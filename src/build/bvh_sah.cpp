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
        if (is_surely_leaf(node)) return {};
        const ObjectSplit split = find_object_split(node, parallel_);
        if (is_leaf(node, split.cost, options_)) return {};
        return split_objects(node, split, depth, parallel_);
    }

private:
    /// Whether even children that each fit one reference would not pay: half of all leaves are
    /// found so, without a look for a split.
    [[nodiscard]] bool is_surely_leaf(const NodeRange& node) const {
        if (node.refs.size() > kFewReferences) return false;
        float least_cost = 0.0f;
        for (const Reference& r : node.refs) least_cost += r.bounds().half_area();
        return is_leaf(node, least_cost, options_);
    }

    const BuildOptions& options_;
    const Parallel& parallel_;
};

}  // namespace

Hierarchy build_bvh_sah(ScratchVector<Reference> references, const BuildOptions& options,
                        const Parallel& parallel) {
    return TopDownBuilder(std::move(references), 0, parallel, SahSplit(options, parallel)).build();
}

}  // namespace packet
