// How a box is cut into cells: their number along each axis, the planes between them, and which
// cells a box reaches into.
#pragma once

#include "build/references.h"
#include "core/views.h"

#include <packet/bounds.h>

#include <algorithm>
#include <cstdint>

namespace packet {

/// Cells from `first` to `last`, both included, along each axis.
struct CellRange {
    int first[3], last[3];

    [[nodiscard]] int side(int axis) const noexcept { return last[axis] - first[axis] + 1; }
    [[nodiscard]] std::size_t count() const noexcept {
        return static_cast<std::size_t>(side(0)) * static_cast<std::size_t>(side(1)) *
               static_cast<std::size_t>(side(2));
    }
    /// Along one axis at most there is more than one cell.
    [[nodiscard]] bool is_row() const noexcept {
        return (side(0) > 1) + (side(1) > 1) + (side(2) > 1) <= 1;
    }
};

/// The only place that computes planes: the build and the walk read the same floats.
// NOLINTNEXTLINE(bugprone-reserved-identifier,readability-identifier-naming): of implicit copies
class GridSpace {
public:
    /// About `cell_count` cells, as near to cubes as whole numbers allow (the cube root rule). An
    /// axis along which the box is thinner than such a cube gets one cell, and the others share.
    GridSpace(const Bounds3f& bounds, double cell_count);

    [[nodiscard]] const Bounds3f& bounds() const noexcept { return bounds_; }
    [[nodiscard]] int side(int axis) const noexcept { return side_[axis]; }
    /// Along an axis, bricks filled up with flat cells at the upper face.
    [[nodiscard]] int brick_side(int axis) const noexcept {
        return (side_[axis] + kBrickSide - 1) / kBrickSide;
    }
    [[nodiscard]] std::size_t cell_count() const noexcept {
        return static_cast<std::size_t>(side_[0]) * static_cast<std::size_t>(side_[1]) *
               static_cast<std::size_t>(side_[2]);
    }
    [[nodiscard]] std::size_t brick_count() const noexcept {
        return static_cast<std::size_t>(brick_side(0)) * static_cast<std::size_t>(brick_side(1)) *
               static_cast<std::size_t>(brick_side(2));
    }
    /// Numbers of cells are below this.
    [[nodiscard]] std::size_t cell_id_end() const noexcept { return 64 * brick_count(); }
    [[nodiscard]] const AlignedVector<float>& planes(int axis) const noexcept {
        return planes_[axis];
    }
    [[nodiscard]] float bricks_per_unit(int axis) const noexcept {
        return static_cast<float>(cells_per_unit_[axis] / kBrickSide);
    }

    /// The cells that the box reaches into. Of two cells whose common face it only touches, it
    /// reaches into the one that more of it is in; if it lies in the face, into the upper one.
    [[nodiscard]] CellRange range_of(const Bounds3f& box) const noexcept;
    /// The box of the cells together.
    [[nodiscard]] Bounds3f box_of(const CellRange& range) const noexcept {
        Bounds3f out;
        for (int a = 0; a < 3; ++a) {
            out.lower[a] = plane(a, range.first[a]);
            out.upper[a] = plane(a, range.last[a] + 1);
        }
        return out;
    }
    /// The number of a cell: 64 times that of its brick, and its bit.
    [[nodiscard]] std::uint32_t cell_id(int x, int y, int z) const noexcept {
        return id_of_[0][static_cast<std::size_t>(x)] + id_of_[1][static_cast<std::size_t>(y)] +
               id_of_[2][static_cast<std::size_t>(z)];
    }
    /// The number of the cell that a point within the bounds is in.
    [[nodiscard]] std::uint32_t cell_id(const glm::vec3& point) const noexcept {
        return cell_id(cell_at(0, point.x), cell_at(1, point.y), cell_at(2, point.z));
    }
    /// The cell of a number.
    [[nodiscard]] CellRange cell_of(std::uint32_t id) const noexcept;

private:
    /// The last cell that begins at x or below.
    [[nodiscard]] int cell_at(int axis, float x) const noexcept {
        const float* const planes = planes_[axis].data();
        const double guess = static_cast<double>(x - bounds_.lower[axis]) * cells_per_unit_[axis];
        const int cell = std::min(static_cast<int>(guess), side_[axis] - 1);
        return planes[cell] <= x && x < planes[cell + 1] ? cell : cell_near(axis, cell, x);
    }
    /// The same, where a guess may be wrong.
    [[nodiscard]] int cell_near(int axis, int cell, float x) const noexcept;
    [[nodiscard]] float plane(int axis, int i) const noexcept {
        return planes_[axis][static_cast<std::size_t>(i)];
    }

    int side_[3];
    Bounds3f bounds_;
    double cells_per_unit_[3];
    AlignedVector<float> planes_[3];
    AlignedVector<std::uint32_t> id_of_[3];  ///< what a place along an axis adds to the number
};

}  // namespace packet
