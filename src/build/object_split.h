// Where to part a node's references in two, by their centroids: among the borders of equal bins
// along each axis, where the expected cost of tracing the halves is least.
//
// Wald. On fast construction of SAH-based bounding volume hierarchies. Interactive Ray Tracing
// 2007.
#pragma once

#include "build/bin_sweep.h"
#include "build/lane_bounds.h"

#include <cstddef>
#include <cstdint>
#include <limits>

namespace packet {

/// Up to so many references all places between neighbours along each axis are tried, which then
/// takes no longer than bins, and half the time if they are 8.
inline constexpr std::size_t kFewReferences = 8;

/// Maps centroids to bins. Axes along which centroids do not differ enough to be told apart in
/// float have scale 0, and all in bin 0.
class Binning {
public:
    Binning() = default;
    explicit Binning(const Bounds3f& centroids);

    [[nodiscard]] bool splits(int axis) const noexcept { return scale_vector_[axis] > 0.0f; }
    [[nodiscard]] bool splits_any() const noexcept { return scale_vector_ != glm::vec3(0.0f); }

    /// The bins along x, y and z; the last one means nothing.
    struct BinIds {
        alignas(16) std::int32_t axis[4];
    };
    /// Of what has this doubled centroid.
    [[nodiscard]] PACKET_INLINE BinIds bins(Lanes centroid2) const noexcept {
        const Lanes x = (centroid2 - origin_) * scale_;
        BinIds out;
        xsimd::to_int(xsimd::min(x, Lanes(kBinCount - 0.5f))).store_aligned(out.axis);
        return out;
    }

private:
    glm::vec3 scale_vector_{0.0f};
    Lanes origin_, scale_;
};

struct ObjectSplit {
    /// Of both halves: area times CountUnit of the sample.
    float cost = std::numeric_limits<float>::infinity();
    int axis = -1;                       ///< -1: none
    int place = 0;                       ///< bins below this go first, or so many if they are few
    Bounds3f bounds[2];                  ///< of the halves, unless it is sampled
    bool is_sampled = false;             ///< found from some of the references
    Binning binning;                     ///< if they are not few
    std::uint8_t order[kFewReferences];  ///< if they are few: along the axis
};

/// Searches for splits look at one reference in so many, and at no fewer than `fewest_samples`.
/// Odd, since meshes are often made of pairs of triangles.
[[nodiscard]] std::size_t sample_step(std::size_t count, std::size_t fewest_samples);

/// The cheapest split, if centroids can be told apart. O(references), on several threads if they
/// are many.
[[nodiscard]] ObjectSplit find_object_split(const NodeRange& node, const SahCosts& costs,
                                            const Parallel& parallel, std::size_t fewest_samples);

/// Whether a node is better a leaf, and may be one, than split at a cost of area times count.
[[nodiscard]] bool is_leaf(const NodeRange& node, float split_cost, const SahCosts& costs);

/// Whether not even children that each hold one reference would pay: most leaves are found so,
/// without a look for a split. That halves of several may cost less changes one leaf in a thousand.
[[nodiscard]] bool is_surely_leaf(const NodeRange& node, const SahCosts& costs);

/// Parts the references; where a split is none, or not allowed at this depth, into equal halves.
/// Halves of few references do not get the bounds of their centroids, which nothing asks for.
[[nodiscard]] Halves split_objects(const NodeRange& node, const ObjectSplit& split, int depth,
                                   const Parallel& parallel);

}  // namespace packet
