// A landscape: a height field of fractal noise.
//
// Perlin. Improving noise. SIGGRAPH 2002.
// Musgrave, Kolb, Mace. The synthesis and rendering of eroded fractal terrains. SIGGRAPH 1989.
#include "generate.h"
#include "random.h"

#include <glm/common.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>

namespace packet::tools {
namespace {

constexpr float kCoarsest = 2.0f;    // lattice cells a unit in the first octave: a few mountains
constexpr float kRoughness = 0.47f;  // amplitude of an octave by that of the one before
constexpr float kHeight = 0.2f;      // of the mountains, where the square is 2 wide

/// In [-1, 1], for a corner of the noise's lattice.
float corner_value(std::uint64_t seed, std::int32_t x, std::int32_t z) {
    const auto place = static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32 |
                       static_cast<std::uint32_t>(z);
    return Random(seed, place).uniform(-1.0f, 1.0f);
}

/// Values of the lattice's corners, blended so that slope and curvature are continuous.
float noise(std::uint64_t seed, glm::vec2 point) {
    const glm::vec2 cell = glm::floor(point);
    const glm::vec2 s = point - cell;
    const glm::vec2 blend = s * s * s * (s * (s * 6.0f - 15.0f) + 10.0f);
    const auto x = static_cast<std::int32_t>(cell.x), z = static_cast<std::int32_t>(cell.y);
    const float near = glm::mix(corner_value(seed, x, z), corner_value(seed, x + 1, z), blend.x);
    const float far =
        glm::mix(corner_value(seed, x, z + 1), corner_value(seed, x + 1, z + 1), blend.x);
    return glm::mix(near, far, blend.y);
}

/// Sharp ridges where the noise changes sign; rough on the heights and smooth in the valleys.
/// Details finer than `finest` lattice cells a unit are left out: the grid could not show them.
float height_at(std::uint64_t seed, glm::vec2 point, float finest) {
    Random octave_seeds(seed);
    float height = 0.0f, amplitude = kHeight, roughness = 1.0f;
    for (float frequency = kCoarsest; frequency <= finest; frequency *= 2.0f) {
        const float ridge = 1.0f - std::abs(noise(octave_seeds.next(), frequency * point));
        height += amplitude * roughness * ridge * ridge;
        roughness = ridge;
        amplitude *= kRoughness;
    }
    return height;
}

}  // namespace

TriangleMesh make_terrain(std::size_t triangle_count, std::uint64_t seed) {
    const std::size_t cells = std::max<std::size_t>(triangle_count / 2, 1);
    const auto columns = static_cast<std::size_t>(std::sqrt(static_cast<double>(cells)));
    const std::size_t rows = cells / columns;
    const glm::vec2 step = 2.0f / glm::vec2(columns, rows);
    const float finest =
        std::max(0.25f / step.x, kCoarsest);  // four vertices a cell show its shape

    TriangleMesh mesh;
    mesh.name = "terrain";
    mesh.positions.reserve((columns + 1) * (rows + 1));
    for (std::size_t row = 0; row <= rows; ++row) {
        for (std::size_t column = 0; column <= columns; ++column) {
            const glm::vec2 point = step * glm::vec2(column, row) - 1.0f;
            mesh.positions.emplace_back(point.x, height_at(seed, point, finest), point.y);
        }
    }
    mesh.triangles.reserve(2 * columns * rows);
    const auto pitch = static_cast<std::uint32_t>(columns + 1);
    for (std::uint32_t row = 0; row < rows; ++row) {
        for (std::uint32_t column = 0; column < columns; ++column) {
            const std::uint32_t corner = row * pitch + column;
            mesh.triangles.emplace_back(corner, corner + pitch, corner + 1);
            mesh.triangles.emplace_back(corner + 1, corner + pitch, corner + pitch + 1);
        }
    }
    return mesh;
}

}  // namespace packet::tools
