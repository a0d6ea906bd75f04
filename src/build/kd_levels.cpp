#include "build/kd_levels.h"

#include "build/kd_cell.h"
#include "build/kd_large_stage.h"
#include "build/kd_small_stage.h"

namespace packet {

// Of the time that both stages take, about.
static constexpr double kShareOfLarge = 0.35;

/// The only cell of the first level: it holds everything.
static KdLevel make_root(ScratchVector<Reference> references, const BuildOptions& options) {
    Cell root;
    fill_root(root, std::move(references), options, kMaxReferences);
    KdLevel level;
    level.references.reserve(root.references.size());
    for (const Reference& r : root.references) {
        const Bounds3f box = without_negative_zero(r.bounds());
        level.references.push_back({box.lower, r.id, box.upper});
    }
    level.cells.push_back(
        {without_negative_zero(root.bounds), 0, root.references.size(), root.spare});
    return level;
}

Hierarchy build_kd_levels(MeshView mesh, ScratchVector<Reference> references,
                          const BuildOptions& options, const Parallel& parallel) {
    if (references.empty()) return {};
    const int max_depth = max_cut_depth(references.size());
    KdLevel root = make_root(std::move(references), options);
    Hierarchy out;
    parallel.run([&] {
        KdLargeStage large =
            run_large_stage(mesh, std::move(root), options, parallel, kShareOfLarge);
        out = run_small_stage(mesh, std::move(large), max_depth, options, parallel,
                              1.0 - kShareOfLarge);
    });
    return out;
}

}  // namespace packet
