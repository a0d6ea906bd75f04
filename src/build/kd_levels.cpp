#include "build/kd_levels.h"

#include "build/kd_cell.h"
#include "build/kd_large_stage.h"
#include "build/kd_small_stage.h"

namespace packet {

// Of the time that both stages take, about.
static constexpr double kShareOfLarge = 0.35;

/// A level of one cell that holds everything.
static KdLevel make_root(ScratchVector<Reference> references, const BuildOptions& options) {
    Cell root;
    fill_root(root, std::move(references), options, kMaxReferences);
    KdLevel level;
    level.references.assign(root.references.begin(), root.references.end());
    level.cells.push_back({root.bounds, 0, root.references.size(), root.spare});
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
