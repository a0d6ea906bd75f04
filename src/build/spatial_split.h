// Where to part a node's space in two, and the triangles that reach to both sides with it: among
// planes between equal slices of its box, where the expected cost of tracing the halves is least.
//
// Stich, Friedrich, Dietrich. Spatial splits in bounding volume hierarchies. High-Performance
// Graphics 2009.
#pragma once

#include "build/sah_costs.h"
#include "build/split.h"

#include <cstddef>
#include <limits>
#include <optional>

namespace packet {

struct SpatialSplit {
    /// Of both sides: area times how many of the sample.
    float cost = std::numeric_limits<float>::infinity();
    int axis = -1;  ///< -1: none
    float position = 0.0f;
    Bounds3f bounds[2];             ///< of the sides, about
    float count[2] = {0.0f, 0.0f};  ///< references on them, about
};

/// The cheapest plane among those that add no more references than the node has room for, as a
/// sample of them tells. O(references), on several threads if they are many.
[[nodiscard]] SpatialSplit find_spatial_split(MeshView mesh, const NodeRange& node,
                                              const SahCosts& costs, const Parallel& parallel,
                                              std::size_t fewest_samples);

/// Parts the references at the plane. Those that reach to both sides are cut, if there is room, or
/// go whole to one side where that is expected to cost less. None, and nothing is cut, where that
/// might not be allowed at this depth.
[[nodiscard]] std::optional<Halves> split_space(MeshView mesh, const NodeRange& node,
                                                const SpatialSplit& split, int depth,
                                                const Parallel& parallel);

}  // namespace packet
