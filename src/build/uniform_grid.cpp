#include "build/uniform_grid.h"

#include "build/grid_layout.h"

#include <limits>

namespace packet {

Tree build_uniform_grid(MeshView mesh, const ScratchVector<Reference>& references,
                        const BuildOptions& options, const Parallel& parallel) {
    Tree out;
    if (references.empty()) return out;
    parallel.run([&] {
        const CellLists cells = sort_into_cells(
            mesh, references, static_cast<double>(options.grid_density), options, parallel);
        out = make_grid(cells, std::numeric_limits<std::uint32_t>::max(), mesh, parallel);
        const double cost =
            static_cast<double>(cells.space.cell_count()) *
                static_cast<double>(options.traversal_cost) +
            static_cast<double>(cells.ids.size()) * static_cast<double>(options.intersection_cost);
        out.stats.sah_cost = cell_share(cells.space) * cost;
    });
    out.stats.bytes = out.byte_count();
    return out;
}

}  // namespace packet
