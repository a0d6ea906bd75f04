// Cuts the 8-wide form of a tree into treelets: parts of so many bytes that one stays in a core's
// cache while many rays go through it (src/schedule/treelet_sweep.h). A treelet is a node, its
// root, and nodes below it that hang together. So a link that leaves a treelet leads to the root of
// another, and a ray that walks down enters each at most once.
//
// Aila, Karras. Architecture considerations for tracing incoherent rays. High-Performance Graphics
// 2010.
#pragma once

#include "build/tree.h"
#include "schedule/parallel.h"

#include <span>

namespace packet {

/// Rays through trees of a lower SAH cost meet so few nodes that streams take less time than
/// waiting at treelets does: docs/experiments.md#treelets.
inline constexpr double kLeastCostToCut = 128.0;

/// Cuts the tree into treelets by `options`, and lays its wide nodes out treelet by treelet, each
/// depth first; a treelet comes before those below it. Fills tree.treelets and the statistics.
/// Nothing for a grid, or if `options` want none. The same for any number of threads. For areas
/// O(nodes * nodes of a treelet) at worst, mostly some steps a node; for subtrees O(nodes).
void cut_into_treelets(Tree& tree, AccelKind kind, const BuildOptions& options,
                       const Parallel& parallel);

/// By which nodes become roots of treelets; a table of them by node.
[[nodiscard]] std::vector<bool> treelet_roots_by_area(std::span<const WideNode> nodes,
                                                      std::size_t most_bytes,
                                                      const Parallel& parallel);
[[nodiscard]] std::vector<bool> treelet_roots_by_subtree(std::span<const WideNode> nodes,
                                                         std::size_t most_bytes);

/// What of a tree that is cut as `tree.treelets` says there is to tell.
[[nodiscard]] TreeletStats count_treelets(const Tree& tree);

}  // namespace packet
