#include "build/kd_breadth_first.h"

#include "build/kd_cell.h"
#include "build/kd_large_stage.h"
#include "build/kd_small_stage.h"

namespace packet {

// Of a build's time, about.
static constexpr double kShareOfLarge = 0.6;

Hierarchy build_kd_breadth_first(MeshView mesh, AlignedVector<Reference> references,
                                 const BuildOptions& options, const Parallel& parallel) {
    if (references.empty()) return {};
    Cell root;
    fill_root(root, std::move(references), options, kMaxReferences);
    const int max_depth = max_cut_depth(root.references.size());
    KdLevel level;
    level.references.assign(root.references.begin(), root.references.end());
    KdRange range{root.bounds, 0, root.references.size(), root.spare};
    level.cells.push_back(range);
    root.references = {};
    Hierarchy out;
    parallel.run([&] {
        KdLargeStage large =
            run_large_stage(mesh, std::move(level), options, parallel, kShareOfLarge);
        out = run_small_stage(mesh, std::move(large), max_depth, options, parallel,
                              1.0 - kShareOfLarge);
    });
    return out;
}

}  // namespace packet
