// Where the best split of a node's references leaves halves that overlap, the best split of its
// space is tried as well, and the cheaper one taken. Cutting adds references: what a node may add
// is shared by its children in proportion to what they hold and to their area, so it does not
// depend on which thread comes first.
//
// What is cheaper split by split may cost more in the end, where planes near the root strew parts
// of large triangles over subtrees, and moving these mends less of it. So the tree without cuts is
// built, too, and the cheaper one kept.
//
// Stich, Friedrich, Dietrich. Spatial splits in bounding volume hierarchies. High-Performance
// Graphics 2009.
#include "build/bvh_spatial.h"

#include "build/bvh_sah.h"
#include "build/cell.h"
#include "build/object_split.h"
#include "build/reinsertion.h"
#include "build/spatial_split.h"
#include "build/split.h"
#include "build/wide_cuts.h"

#include <algorithm>

namespace packet {

namespace {

// Overlap that is worth a try, as a share of the root's area and of the node's own: smooth surfaces
// have too little nearly everywhere, and build sooner. Measured:
// docs/experiments.md#quality-of-hierarchies.
constexpr float kLeastOfRoot = 3e-5f;
constexpr float kLeastOfNode = 0.05f;

// For both searches, whose costs are compared.
constexpr std::size_t kFewestSamples = 16384;

float overlap(const Bounds3f& a, const Bounds3f& b) {
    return Bounds3f{glm::max(a.lower, b.lower), glm::min(a.upper, b.upper)}.half_area();
}

class SpatialSahSplit {
public:
    SpatialSahSplit(MeshView mesh, float root_area, const BuildOptions& options,
                    const Parallel& parallel)
        : mesh_(mesh),
          least_overlap_(kLeastOfRoot * root_area),
          costs_(options),
          parallel_(parallel) {}

    std::optional<Halves> operator()(const NodeRange& node, int depth) const {
        if (is_surely_leaf(node, costs_)) return {};
        const ObjectSplit objects = find_object_split(node, costs_, parallel_, kFewestSamples);
        SpatialSplit space;
        if (is_worth_cutting(node, objects)) {
            space = find_spatial_split(mesh_, node, costs_, parallel_, kFewestSamples);
        }
        if (is_leaf(node, std::min(objects.cost, space.cost), costs_)) return {};
        if (space.cost < objects.cost) {
            if (auto halves = split_space(mesh_, node, space, depth, parallel_)) return halves;
        }
        return split_objects(node, objects, depth, parallel_);
    }

private:
    [[nodiscard]] bool is_worth_cutting(const NodeRange& node, const ObjectSplit& objects) const {
        if (node.room == 0) return false;
        const float area = node.bounds.box.half_area();
        const float shared =
            objects.axis < 0 ? area : overlap(objects.bounds[0], objects.bounds[1]);
        return shared > std::max(least_overlap_, kLeastOfNode * area);
    }

    MeshView mesh_;
    float least_overlap_;
    SahCosts costs_;
    const Parallel& parallel_;
};

/// How many references cutting may add.
std::size_t room(std::size_t count, const BuildOptions& options) {
    const double wanted = static_cast<double>(options.spatial_budget) * static_cast<double>(count);
    return static_cast<std::size_t>(
        std::min(wanted, static_cast<double>(kMaxReferences - std::min(count, kMaxReferences))));
}

Hierarchy build_with_cuts(MeshView mesh, ScratchVector<Reference> references, std::size_t spare,
                          const BuildOptions& options, const Parallel& parallel) {
    NodeBounds root;
    parallel.run([&] { root = measure(references, parallel); });
    Hierarchy out = TopDownBuilder(std::move(references), spare, parallel,
                                   SpatialSahSplit(mesh, root.box.half_area(), options, parallel))
                        .build();
    reinsert_subtrees(out, parallel);
    return out;
}

// Of the time, about; without cuts it takes the rest.
constexpr double kShareWithCuts = 0.75;
// Where fewer references than one in so many were added, both trees are about the same.
constexpr std::size_t kFewCuts = 64;

struct Weight {
    std::size_t references;
    double sah_cost;
};
Weight weigh(const Hierarchy& hierarchy, const BuildOptions& options, const Parallel& parallel) {
    const WideCuts cuts(hierarchy, kBlockSize, parallel, 0.0);
    return {cuts.item_count(0), cuts.stats(options).sah_cost};
}

}  // namespace

Hierarchy build_bvh_spatial(MeshView mesh, ScratchVector<Reference> references,
                            const BuildOptions& options, const Parallel& parallel) {
    const std::size_t count = references.size(), spare = room(count, options);
    Hierarchy cut = build_with_cuts(mesh, std::move(references), spare, options,
                                    parallel.part(parallel.threads(), kShareWithCuts));
    if (count == 0) return cut;
    const Weight with_cuts = weigh(cut, options, parallel);
    if (with_cuts.references - count <= count / kFewCuts) return cut;
    References uncut;
    parallel.run([&] { uncut = collect_references(mesh, parallel); });
    Hierarchy plain = build_bvh_sah(std::move(uncut.items), options,
                                    parallel.part(parallel.threads(), 1.0 - kShareWithCuts));
    if (weigh(plain, options, parallel).sah_cost < with_cuts.sah_cost) std::swap(cut, plain);
    // The tree that is made next is not to come on top of both.
    give_back_pages(plain.nodes.data(), plain.nodes.capacity() * sizeof(BuildNode));
    return cut;
}

}  // namespace packet
