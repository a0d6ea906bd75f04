// What structure to build, how, and what came of it.
#pragma once

#include <packet/mesh.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>

namespace packet {

/// The acceleration structures. They differ in how they are built, not in what they answer.
enum class AccelKind : std::uint8_t {
    /// bounding volume hierarchy by the binned surface area heuristic; then large subtrees move to
    /// where that expects less
    kBvh,
    kBvhMidpoint,  ///< one split at the middle of the centroids
    kBvhMorton,    ///< one by the Morton codes of the centroids: the fastest to build
    kBvhSpatial,   ///< as kBvh, but cutting triangles where nodes would overlap, if it pays in all
    kKdMidpoint,   ///< k-d tree, cells cut in the middle, axes in turn
    kKdMedian,     ///< k-d tree, cells cut at the median of what they hold, axes in turn
    kKdSah,        ///< k-d tree, cells cut by the surface area heuristic
    kOctree,       ///< cubes cut into eight equal ones
    kGrid,         ///< uniform grid: equal cells, in proportion to the triangles
    kGridOfTrees   ///< coarse grid whose crowded cells hold hierarchies of their own
};

/// How much time the build of a bounding volume hierarchy may take for faster tracing.
enum class BuildQuality : std::uint8_t {
    kFast,      ///< that of kBvhMorton
    kBalanced,  ///< that of kBvh
    kHigh       ///< that of kBvhSpatial
};

/// How `kKdSah` is built.
enum class KdBuild : std::uint8_t {
    kSorted,       ///< cell by cell, from all places where triangles' boxes start and end, sorted
    kBreadthFirst  ///< level by level; while cells are large, from some of these places
};

/// How trees are cut into treelets, the parts that `Mode::kTreelet` queues rays at.
enum class TreeletCut : std::uint8_t {
    kAreas,    ///< so that rays are expected to enter least of them
    kSubtrees  ///< subtrees as large as allowed, then what is above them in the same way
};

/// A size of treelets that serves `Mode::kTreelet` well: docs/experiments.md#treelets.
inline constexpr std::size_t kUsualTreeletBytes = std::size_t{1} << 20;
/// Trees of so many bytes, which is more than the last level of most caches holds, may be cut into
/// treelets if nothing else is asked for.
inline constexpr std::size_t kLeastBytesToCut = std::size_t{32} << 20;

struct BuildOptions {
    AccelKind accel = AccelKind::kBvh;
    /// Which builder serves `kBvh`. Every other structure names its own: with one of them, anything
    /// but kBalanced is an Error{kUnsupported}.
    BuildQuality quality = BuildQuality::kBalanced;
    /// For `kKdSah`. By levels a million triangles take half to two thirds of the time, at 1% less
    /// to 2% more SAH cost in generated scenes, and there may be 2^31 of them, not 2^30.
    KdBuild kd_build = KdBuild::kBreadthFirst;
    /// Largest leaf, in triangles, 1 to 64. Larger leaves build faster and trace slower.
    int max_leaf_size = 8;
    /// Cost of visiting a node, in triangle tests. Raise it for flatter trees with larger leaves.
    float traversal_cost = 1.0f;
    /// Cost of testing a triangle. Only its ratio to `traversal_cost` matters. Hierarchies of boxes
    /// count blocks of 8, which are tested at once, as two.
    float intersection_cost = 1.0f;
    /// References to triangles, at most, in multiples of the triangles, 1 to 64, where cells cut
    /// triangles (k-d trees, octree, grids). A part of the tree that has used up its share parts
    /// triangles without cutting them. Lower it to save memory, 40 bytes a reference and while
    /// building about 250. Doubling it lowers the SAH cost of generated scenes by 0 to 9%, mostly
    /// below 3%.
    float max_reference_factor = 4.0f;
    /// References that cutting triangles may add, at most, in multiples of the triangles, 0 to 8,
    /// for `kBvhSpatial`. Raise it for scenes of large triangles that lie across each other;
    /// others do not use it up. Each takes 40 bytes, and while building about 110.
    float spatial_budget = 0.5f;
    /// Cells of an octree have sides of at least 2^-octree_levels of the scene's largest, 0 to 21.
    /// What is crowded in smaller ones is parted without cutting it. Lower it to save memory.
    int octree_levels = 21;
    /// Cells of a grid, in multiples of the triangles, 1/64 to 64. More cells hold fewer triangles
    /// each, cut more of them, and take more steps to cross. A grid gets fewer where it would else
    /// exceed `max_reference_factor`.
    float grid_density = 2.0f;
    /// Bits of Morton codes, for `kBvhMorton`: 30, 63, or 0 to choose by the number of triangles.
    /// 30 sort faster, 63 tell apart what is 2^-21 of the scene's extent from each other.
    int morton_bits = 0;
    /// Keep trees in their binary form, too, for CUDA devices, which walk that. 32 bytes a node.
    bool keep_binary_nodes = false;
    /// Bytes of a treelet, at most, with its triangles (but one node is not cut). Rays enter fewer
    /// large ones, small ones stay in a nearer cache. 0 cuts none: then `Mode::kAuto` does without
    /// them, and `Mode::kTreelet` is as `Mode::kStream`. Without a value it is kUsualTreeletBytes
    /// from kLeastBytesToCut and a SAH cost of 128 on, where cutting takes a tenth of the time of
    /// building, and 0 for other trees, and for `kBvhMorton`, of whose time it takes a third.
    std::optional<std::size_t> treelet_bytes;
    TreeletCut treelet_cut = TreeletCut::kAreas;
    /// Threads to build with, at most the CPU's; 0 takes all of them, 1 starts none. The tree is
    /// the same for any number.
    int threads = 0;
    /// Told how far the build is, roughly, as a fraction from 0 to 1 that never decreases: at the
    /// start, then every 5 ms or hundredth, and at the end. False ends the build, within some
    /// milliseconds: commit() throws Error{kCancelled} and the scene stays as it was. So do
    /// exceptions, which commit() passes on. Called by any of the build's threads, by one at a
    /// time; it must not use the scene. Without it a build is not slower.
    std::function<bool(float fraction)> progress;
};

/// The treelets of a tree; of a scene the sums, and the greatest of the last two.
struct TreeletStats {
    std::size_t count = 0;
    std::size_t bytes = 0;      ///< of nodes and triangles; what two treelets share counts twice
    std::size_t cut_edges = 0;  ///< links that lead from one to another
    std::size_t most_bytes = 0;
    double expected_entries = 0.0;  ///< by a random ray that meets the root's box
};

struct BuildStats {
    double seconds = 0.0;
    std::size_t bytes = 0;  ///< memory of nodes and triangle blocks
    std::size_t node_count = 0;
    std::size_t leaf_count = 0;
    int depth = 0;  ///< edges from the root to the deepest leaf
    /// Expected cost of a random ray that meets the root's box: each node of two children that it
    /// meets is `traversal_cost`, each block of up to 8 triangles of a leaf 2 `intersection_cost`.
    double sah_cost = 0.0;
    SkippedTriangles skipped;
    TreeletStats treelets;
};

/// The structure that the options come to: `accel`, or the one that serves `kBvh` by `quality`.
/// Throws Error{kUnsupported} for a quality with a structure that has none.
[[nodiscard]] AccelKind chosen_accel(const BuildOptions& options);

/// A quality's name on the command line.
struct QualityName {
    BuildQuality quality;
    std::string_view name;
};
[[nodiscard]] std::span<const QualityName> quality_names() noexcept;
[[nodiscard]] std::string_view to_string(BuildQuality quality) noexcept;
/// Throws Error{kUnknownName} that lists the valid names.
[[nodiscard]] BuildQuality parse_quality(std::string_view name);

/// A structure's name on the command line and in files.
struct AccelName {
    AccelKind kind;
    std::string_view name;
};

/// The name of a way to build `kKdSah`.
struct KdBuildName {
    KdBuild build;
    std::string_view name;
};

/// Every structure the library builds, in the order in which help lists them.
[[nodiscard]] std::span<const AccelName> accel_names() noexcept;
[[nodiscard]] std::string_view to_string(AccelKind kind) noexcept;
/// Throws Error{kUnknownName} that lists the valid names.
[[nodiscard]] AccelKind parse_accel(std::string_view name);

/// Every way to build `kKdSah`.
[[nodiscard]] std::span<const KdBuildName> kd_build_names() noexcept;
/// Throws Error{kUnknownName} that lists the valid names.
[[nodiscard]] KdBuild parse_kd_build(std::string_view name);

}  // namespace packet
