// A cell of space while a k-d tree is built: what it refers to, what cutting it would cost, and how
// a plane cuts it.
#pragma once

#include "build/cell.h"

#include <packet/accel.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace packet {

/// Where boxes begin and end along each axis, in the order in which a plane meets them; kd_events.h
/// says how they are stored.
using EventList = ScratchVector<std::uint64_t>;
using EventLists = std::array<EventList, 3>;

struct KdCell : Cell {
    EventLists events;  ///< kd-sah only
};

/// Two sides have references; one that reaches to both is cut and counts on both.
inline constexpr int kBothSides = 2;

struct KdPlane {
    double cost = 0.0;
    float position = 0.0f;
    int axis = -1;      ///< -1: no cut
    int flat_side = 0;  ///< where references go that lie in the plane

    [[nodiscard]] bool is_cut() const noexcept { return axis >= 0; }
    [[nodiscard]] int side_of(const Reference& r) const noexcept {
        if (r.lower[axis] == position && r.upper[axis] == position) return flat_side;
        if (r.upper[axis] <= position) return 0;
        return r.lower[axis] >= position ? 1 : kBothSides;
    }
};

struct KdCounts {
    std::size_t side[2] = {0, 0};

    /// A cut must leave something on both sides and not add more references than the cell may.
    template <class AnyCell>
    [[nodiscard]] bool allow_cut(const AnyCell& cell) const noexcept {
        return side[0] != 0 && side[1] != 0 &&
               side[0] + side[1] <= cell.reference_count() + cell.spare;
    }
};

/// The surface area heuristic for one cell. All costs have the cell's area as a factor, so that
/// flat cells need no division.
class KdCost {
public:
    KdCost(const Bounds3f& cell, std::size_t reference_count, const BuildOptions& options) noexcept;
    template <class AnyCell>
    KdCost(const AnyCell& cell, const BuildOptions& options) noexcept
        : KdCost(cell.bounds, cell.reference_count(), options) {}

    [[nodiscard]] double leaf() const noexcept { return leaf_; }
    /// One side ends at `end` and the other begins at `begin`, at most what lies between is empty.
    [[nodiscard]] double cut(int axis, float end, float begin,
                             const KdCounts& counts) const noexcept {
        const double below = static_cast<double>(end) - lower_[axis];
        const double above = upper_[axis] - static_cast<double>(begin);
        return traversal_ +
               intersection_ * (static_cast<double>(counts.side[0]) * area(axis, below) +
                                static_cast<double>(counts.side[1]) * area(axis, above));
    }

private:
    /// Half the surface of a slice of the cell.
    [[nodiscard]] double area(int axis, double length) const noexcept {
        return section_[axis] + length * rim_[axis];
    }

    double lower_[3], upper_[3];
    double section_[3];  ///< area of the cell's cross section
    double rim_[3];      ///< half the section's circumference
    double intersection_, traversal_, leaf_;
};

/// No cell is cut that is this deep in a tree over so many references. Wald and Havran: deeper cuts
/// do not pay.
[[nodiscard]] int max_cut_depth(std::size_t reference_count) noexcept;

/// By reference, the side it goes to if each gets half of them, by their centroids along the widest
/// axis: for what no plane parts, like triangles that share a vertex.
[[nodiscard]] std::vector<std::uint8_t> sides_of_halves(std::span<const Reference> references,
                                                        const Bounds3f& bounds);

/// Where one of the parent's references is now: 2 * index + side, or kCut.
using KdPlace = std::uint32_t;
inline constexpr KdPlace kCut = 0xFFFFFFFF;

/// The halves of a cell. References that were not cut come first, in their old order.
struct KdChildren {
    std::array<KdCell, 2> cell;
    std::array<std::size_t, 2> whole = {0, 0};  ///< how many are not cut
    std::vector<KdPlace> places;
};

/// Cuts references along with space. No point of a triangle is lost; a child is empty if what the
/// plane seemed to cut off is not there. The children share the spare references by their sizes.
/// On one thread; `parallel` is asked whether to go on.
[[nodiscard]] KdChildren cut_cell(MeshView mesh, const KdCell& cell, const KdPlane& plane,
                                  const Parallel& parallel);

/// Deals the references out to two children that may overlap, half to each.
[[nodiscard]] KdChildren halve_cell(const KdCell& cell, const Parallel& parallel);

}  // namespace packet
