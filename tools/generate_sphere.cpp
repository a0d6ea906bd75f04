// A sphere: an octahedron whose faces are divided evenly and blown up. Its vertices lie on rings
// about the y axis, one at each pole and 4 m on the m-th ring from a pole, shared by all their
// triangles.
#include "generate.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace packet::tools {
namespace {

/// The rings of vertices from pole to pole, `n` of them to the equator.
struct Rings {
    std::uint32_t n;

    /// A ring's distance to the nearer pole, in rings.
    [[nodiscard]] std::uint32_t radius(std::uint32_t ring) const {
        return std::min(ring, 2 * n - ring);
    }
    [[nodiscard]] std::uint32_t vertex_count(std::uint32_t ring) const {
        return std::max(4 * radius(ring), 1u);
    }
    /// The first vertex of a ring. One pole and 4 (1 + ... + m - 1) vertices precede the m-th.
    [[nodiscard]] std::uint32_t first_vertex(std::uint32_t ring) const {
        const std::uint32_t m = radius(ring);
        if (ring <= n) return ring == 0 ? 0 : 1 + 2 * m * (m - 1);
        return 4 * n * n + 1 - 2 * m * (m + 1);
    }
    [[nodiscard]] std::uint32_t vertex(std::uint32_t ring, std::uint32_t place) const {
        return first_vertex(ring) + place % vertex_count(ring);
    }
    /// A vertex of the octahedron |x| + |y| + |z| = n, before it is blown up.
    [[nodiscard]] glm::vec3 point(std::uint32_t ring, std::uint32_t place) const {
        const std::uint32_t m = radius(ring);
        const auto along = static_cast<float>(m == 0 ? 0 : place % m);
        const float rest = static_cast<float>(m) - along;
        const float y = static_cast<float>(n) - static_cast<float>(ring);
        switch (m == 0 ? 0 : place / m) {
            case 0: return {rest, y, along};
            case 1: return {-along, y, rest};
            case 2: return {-rest, y, -along};
            default: return {along, y, -rest};
        }
    }
};

/// The triangles between two neighbouring rings, of which `outer` is nearer to the equator.
void add_band(const Rings& rings, std::uint32_t inner, std::uint32_t outer, TriangleMesh& mesh) {
    const std::uint32_t m = rings.radius(outer);
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (inner > outer) std::swap(b, c);  // the south runs the other way round
        mesh.triangles.emplace_back(a, b, c);
    };
    for (std::uint32_t quarter = 0; quarter < 4; ++quarter) {
        for (std::uint32_t i = 0; i < m; ++i) {
            const std::uint32_t in = quarter * (m - 1) + i, out = quarter * m + i;
            add(rings.vertex(inner, in), rings.vertex(outer, out + 1), rings.vertex(outer, out));
            if (i + 1 == m) break;
            add(rings.vertex(inner, in), rings.vertex(inner, in + 1), rings.vertex(outer, out + 1));
        }
    }
}

}  // namespace

TriangleMesh make_sphere(std::size_t triangle_count, std::uint64_t /*seed*/) {
    const double divisions = std::sqrt(static_cast<double>(triangle_count) / 8.0);
    const Rings rings{std::max(static_cast<std::uint32_t>(divisions), 1u)};

    TriangleMesh mesh;
    mesh.name = "sphere";
    mesh.positions.reserve(4 * std::size_t{rings.n} * rings.n + 2);
    mesh.triangles.reserve(8 * std::size_t{rings.n} * rings.n);
    for (std::uint32_t ring = 0; ring <= 2 * rings.n; ++ring) {
        for (std::uint32_t place = 0; place < rings.vertex_count(ring); ++place) {
            mesh.positions.push_back(glm::normalize(rings.point(ring, place)));
        }
    }
    for (std::uint32_t ring = 0; ring < rings.n; ++ring) add_band(rings, ring, ring + 1, mesh);
    for (std::uint32_t ring = rings.n; ring < 2 * rings.n; ++ring) {
        add_band(rings, ring + 1, ring, mesh);
    }
    return mesh;
}

}  // namespace packet::tools
