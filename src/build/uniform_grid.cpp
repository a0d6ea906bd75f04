#include "build/uniform_grid.h"

#include "build/grid_layout.h"

#include <limits>

namespace packet {

Tree build_uniform_grid(MeshView mesh, const ScratchVector<Reference>& references,
                        const BuildOptions& options, const Parallel& parallel) {
    constexpr std::uint32_t kLongestList = std::numeric_limits<std::uint32_t>::max();
    Tree out;
    if (references.empty()) return out;
    parallel.run([&] {
        const CellLists cells = sort_into_cells(
            mesh, references, static_cast<double>(options.grid_density), options, parallel);
        out = make_grid(cells, kLongestList, mesh, parallel);
        out.stats.sah_cost = expected_cost(cells, kLongestList, options);
    });
    out.stats.bytes = out.byte_count();
    return out;
}

}  // namespace packet
