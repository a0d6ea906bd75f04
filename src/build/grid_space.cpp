#include "build/grid_space.h"

#include <algorithm>
#include <cmath>

namespace packet {

namespace {

// Planes are looked up in tables that have to stay in the cache.
constexpr double kMostCellsPerSide = 16384.0;
// Numbers of cells have 32 bits, and bricks take 16 bytes: 2^26 of them are 1 GiB.
constexpr std::size_t kMostBricks = std::size_t{1} << 26;

/// The side of the cubes that would cut the box into so many. Axes shorter than a cube's side do
/// not count, for they are not cut.
double cube_side(const glm::dvec3& extent, double cell_count) {
    double sorted[3] = {extent.x, extent.y, extent.z};
    std::sort(sorted, sorted + 3);
    const double volume = sorted[0] * sorted[1] * sorted[2];
    const double by_volume = std::cbrt(volume / cell_count);
    if (by_volume > 0.0 && by_volume <= sorted[0]) return by_volume;
    const double by_area = std::sqrt(sorted[1] * sorted[2] / cell_count);
    if (by_area > 0.0 && by_area <= sorted[1]) return by_area;
    return sorted[2] / cell_count;
}

}  // namespace

GridSpace::GridSpace(const Bounds3f& bounds, double cell_count) : bounds_(bounds) {
    const glm::dvec3 extent = glm::dvec3(bounds.upper) - glm::dvec3(bounds.lower);
    for (;; cell_count *= 0.5) {
        const double cube = cube_side(extent, cell_count);
        for (int a = 0; a < 3; ++a) {
            const double sides = cube > 0.0 ? std::round(extent[a] / cube) : 1.0;
            side_[a] = static_cast<int>(std::clamp(sides, 1.0, kMostCellsPerSide));
        }
        if (brick_count() <= kMostBricks) break;
    }
    std::uint32_t brick_step = kBrickSide * kBrickSide * kBrickSide, bit_step = 1;
    for (int a = 0; a < 3; ++a) {
        cells_per_unit_[a] = extent[a] > 0.0 ? side_[a] / extent[a] : 0.0;
        for (int i = 0; i < side_[a]; ++i) {
            const double plane =
                static_cast<double>(bounds.lower[a]) + extent[a] * (i / double(side_[a]));
            planes_[a].push_back(std::min(static_cast<float>(plane), bounds.upper[a]));
            const auto brick = static_cast<std::uint32_t>(i / kBrickSide);
            id_of_[a].push_back(brick * brick_step +
                                static_cast<std::uint32_t>(i % kBrickSide) * bit_step);
        }
        const auto brick_sides = static_cast<std::size_t>(brick_side(a));
        planes_[a].resize(kBrickSide * brick_sides + 1, bounds.upper[a]);
        brick_step *= static_cast<std::uint32_t>(brick_sides);
        bit_step *= kBrickSide;
    }
}

int GridSpace::cell_near(int axis, int cell, float x) const noexcept {
    const float* const planes = planes_[axis].data();
    while (cell > 0 && planes[cell] > x) --cell;
    while (cell + 1 < side_[axis] && planes[cell + 1] <= x) ++cell;
    return cell;
}

CellRange GridSpace::range_of(const Bounds3f& box) const noexcept {
    CellRange out;
    for (int a = 0; a < 3; ++a) {
        out.first[a] = out.last[a] = cell_at(a, box.lower[a]);
        if (box.upper[a] <= plane(a, out.first[a] + 1)) continue;
        out.last[a] = cell_at(a, box.upper[a]);
        while (out.last[a] > out.first[a] && plane(a, out.last[a]) >= box.upper[a]) {
            --out.last[a];
        }
    }
    return out;
}

CellRange GridSpace::cell_of(std::uint32_t id) const noexcept {
    CellRange out;
    std::uint32_t brick = id / 64;
    for (int a = 0; a < 3; ++a) {
        const auto sides = static_cast<std::uint32_t>(brick_side(a));
        const std::uint32_t in_brick = id >> 2 * a & 3;
        out.first[a] = out.last[a] = static_cast<int>(brick % sides * kBrickSide + in_brick);
        brick /= sides;
    }
    return out;
}

}  // namespace packet
