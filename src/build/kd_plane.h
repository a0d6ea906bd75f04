// Planes that cut a cell of a k-d tree, and what they cost. These few lines decide the tree: they
// are the same for the CPU's threads and for those of CUDA.
#pragma once

#include "build/references.h"
#include "core/macros.h"

#include <packet/accel.h>

#include <cstddef>

namespace packet {

/// Two sides have references; one that reaches to both is cut and counts on both.
inline constexpr int kBothSides = 2;

struct KdPlane {
    double cost = 0.0;
    float position = 0.0f;
    int axis = -1;      ///< -1: no cut
    int flat_side = 0;  ///< where references go that lie in the plane

    [[nodiscard]] constexpr bool is_cut() const noexcept { return axis >= 0; }
    [[nodiscard]] PACKET_INLINE int side_of(const Reference& r) const noexcept {
        if (r.lower[axis] == position && r.upper[axis] == position) return flat_side;
        if (r.upper[axis] <= position) return 0;
        return r.lower[axis] >= position ? 1 : kBothSides;
    }
};

struct KdCounts {
    std::size_t side[2] = {0, 0};

    /// A cut must leave something on both sides and not add more references than the cell may.
    template <class AnyCell>
    [[nodiscard]] PACKET_INLINE bool allow_cut(const AnyCell& cell) const noexcept {
        return side[0] != 0 && side[1] != 0 &&
               side[0] + side[1] <= cell.reference_count() + cell.spare;
    }
};

/// Along which what no plane parts is parted.
[[nodiscard]] constexpr int widest_axis(const Bounds3f& bounds) noexcept {
    const glm::vec3 extent = bounds.extent();
    if (extent.x >= extent.y && extent.x >= extent.z) return 0;
    return extent.y >= extent.z ? 1 : 2;
}

/// What the surface area heuristic takes from BuildOptions.
struct KdPrices {
    float traversal_cost, intersection_cost;

    // Not explicit: functions that count take options for prices.
    KdPrices(const BuildOptions& options)
        : traversal_cost(options.traversal_cost), intersection_cost(options.intersection_cost) {}
};

/// The surface area heuristic for one cell. All costs have the cell's area as a factor, so that
/// flat cells need no division.
class KdCost {
public:
    PACKET_INLINE KdCost(const Bounds3f& cell, std::size_t reference_count,
                         const KdPrices& prices) noexcept {
        double extent[3];
        for (int a = 0; a < 3; ++a) {
            lower_[a] = static_cast<double>(cell.lower[a]);
            upper_[a] = static_cast<double>(cell.upper[a]);
            extent[a] = upper_[a] - lower_[a];
        }
        for (int a = 0; a < 3; ++a) {
            section_[a] = extent[(a + 1) % 3] * extent[(a + 2) % 3];
            rim_[a] = extent[(a + 1) % 3] + extent[(a + 2) % 3];
        }
        const double whole = area(0, extent[0]);
        intersection_ = static_cast<double>(prices.intersection_cost);
        traversal_ = static_cast<double>(prices.traversal_cost) * whole;
        leaf_ = intersection_ * whole * static_cast<double>(reference_count);
    }
    template <class AnyCell>
    PACKET_INLINE KdCost(const AnyCell& cell, const KdPrices& prices) noexcept
        : KdCost(cell.bounds, cell.reference_count(), prices) {}

    [[nodiscard]] PACKET_INLINE double leaf() const noexcept { return leaf_; }
    /// One side ends at `end` and the other begins at `begin`, at most what lies between is empty.
    [[nodiscard]] PACKET_INLINE double cut(int axis, float end, float begin,
                                           const KdCounts& counts) const noexcept {
        const double below = static_cast<double>(end) - lower_[axis];
        const double above = upper_[axis] - static_cast<double>(begin);
        return traversal_ +
               intersection_ * (static_cast<double>(counts.side[0]) * area(axis, below) +
                                static_cast<double>(counts.side[1]) * area(axis, above));
    }

private:
    /// Half the surface of a slice of the cell.
    [[nodiscard]] PACKET_INLINE double area(int axis, double length) const noexcept {
        return section_[axis] + length * rim_[axis];
    }

    double lower_[3], upper_[3];
    double section_[3];  ///< area of the cell's cross section
    double rim_[3];      ///< half the section's circumference
    double intersection_, traversal_, leaf_;
};

/// The cheapest plane so far, as planes are looked at one after the other: of equals the first.
template <class AnyCell>
struct KdSearch {
    const AnyCell& cell;
    const KdCost& cost;
    KdPlane best;  ///< no cut if a leaf is not dearer

    PACKET_INLINE KdSearch(const AnyCell& of, const KdCost& by) noexcept : cell(of), cost(by) {
        best.cost = by.leaf();
    }
    /// The plane at `position`; what is below it ends at `end` and what is above begins at `begin`.
    PACKET_INLINE void consider(int axis, float position, float end, float begin,
                                const KdCounts& counts, int flat_side) noexcept {
        if (!counts.allow_cut(cell)) return;
        const double c = cost.cut(axis, end, begin, counts);
        if (c < best.cost) best = {c, position, axis, flat_side};
    }
};

}  // namespace packet
