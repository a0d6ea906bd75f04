// The teapot in the stadium, the scene that uniform grids are bad at: nearly all triangles are in a
// pot of tea at the kick-off spot, and the stands around it are few and huge.
//
// Haines. Spline surface rendering, and what's wrong with octrees. Ray Tracing News 1(1), 1988.
#include "generate.h"

#include <algorithm>
#include <iterator>

namespace packet::tools {
namespace {

// In metres.
constexpr float kField = 50.0f;  // from the middle to the stands
constexpr float kTierDepth = 0.8f;
constexpr float kTierHeight = 0.4f;

constexpr std::size_t kMostTiers = 40;
constexpr std::size_t kTrianglesPerTier = 16;
// Of all triangles at most a sixteenth is in the stands.
constexpr std::size_t kTrianglesForTier = 16 * kTrianglesPerTier;

/// An ellipsoid of the pot and its share of the pot's triangles, about that of the area.
struct Part {
    glm::vec3 center, radii;
    double share;
};
// Two metres wide, so that grids have some cells for it. Parts overlap where they join.
constexpr Part kPot[] = {{{0.0f, 0.72f, 0.0f}, {1.0f, 0.7f, 1.0f}, 0.70},       // body
                         {{0.0f, 0.04f, 0.0f}, {0.7f, 0.04f, 0.7f}, 0.06},      // foot
                         {{0.0f, 1.36f, 0.0f}, {0.55f, 0.12f, 0.55f}, 0.08},    // lid
                         {{0.0f, 1.54f, 0.0f}, {0.12f, 0.12f, 0.12f}, 0.02},    // its knob
                         {{1.05f, 0.66f, 0.0f}, {0.26f, 0.22f, 0.2f}, 0.02},    // spout
                         {{1.25f, 0.84f, 0.0f}, {0.19f, 0.19f, 0.15f}, 0.02},   //
                         {{1.37f, 1.04f, 0.0f}, {0.14f, 0.19f, 0.12f}, 0.02},   //
                         {{1.48f, 1.23f, 0.0f}, {0.13f, 0.14f, 0.1f}, 0.02},    //
                         {{-1.02f, 1.05f, 0.0f}, {0.2f, 0.07f, 0.08f}, 0.01},   // handle
                         {{-1.26f, 1.02f, 0.0f}, {0.16f, 0.08f, 0.08f}, 0.01},  //
                         {{-1.41f, 0.88f, 0.0f}, {0.08f, 0.15f, 0.08f}, 0.01},  //
                         {{-1.39f, 0.68f, 0.0f}, {0.09f, 0.15f, 0.08f}, 0.01},  //
                         {{-1.25f, 0.51f, 0.0f}, {0.15f, 0.11f, 0.08f}, 0.01},  //
                         {{-1.03f, 0.42f, 0.0f}, {0.19f, 0.09f, 0.08f}, 0.01}};

constexpr std::size_t kLeastPerPart = 8;  // of a sphere
constexpr std::size_t kLeastOfPot = kLeastPerPart * std::size(kPot);

void add_part(const Part& part, std::size_t triangle_count, TriangleMesh& mesh) {
    const TriangleMesh sphere = make_sphere(triangle_count);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const glm::vec3& p : sphere.positions) {
        mesh.positions.push_back(part.center + part.radii * p);
    }
    for (const glm::uvec3& t : sphere.triangles) mesh.triangles.push_back(t + first);
}

/// The four corners of a square ring of the stands.
void add_corners(float half_side, float height, TriangleMesh& mesh) {
    mesh.positions.insert(mesh.positions.end(), {{-half_side, height, -half_side},
                                                 {half_side, height, -half_side},
                                                 {half_side, height, half_side},
                                                 {-half_side, height, half_side}});
}

/// The strip between the last two rings of corners.
void add_strip(TriangleMesh& mesh) {
    const auto outer = static_cast<std::uint32_t>(mesh.positions.size()) - 4, inner = outer - 4;
    for (std::uint32_t i = 0; i < 4; ++i) {
        const std::uint32_t next = (i + 1) % 4;
        mesh.triangles.emplace_back(inner + i, inner + next, outer + next);
        mesh.triangles.emplace_back(inner + i, outer + next, outer + i);
    }
}

void add_stands(std::size_t tiers, TriangleMesh& mesh) {
    add_corners(kField, 0.0f, mesh);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size()) - 4;
    mesh.triangles.emplace_back(first, first + 2, first + 1);
    mesh.triangles.emplace_back(first, first + 3, first + 2);
    for (std::size_t i = 0; i < tiers; ++i) {
        const auto tier = static_cast<float>(i);
        const float side = kField + tier * kTierDepth, height = (tier + 1.0f) * kTierHeight;
        add_corners(side, height, mesh);  // up
        add_strip(mesh);
        add_corners(side + kTierDepth, height, mesh);  // and outward
        add_strip(mesh);
    }
}

}  // namespace

TriangleMesh make_stadium(std::size_t triangle_count, std::uint64_t /*seed*/) {
    const std::size_t tiers = std::min(triangle_count / kTrianglesForTier, kMostTiers);
    const std::size_t in_stands = 2 + kTrianglesPerTier * tiers;
    const std::size_t in_pot = std::max(triangle_count, in_stands + kLeastOfPot) - in_stands;

    TriangleMesh mesh;
    mesh.name = "stadium";
    add_stands(tiers, mesh);
    for (const Part& part : kPot) {
        const double more = part.share * static_cast<double>(in_pot - kLeastOfPot);
        add_part(part, kLeastPerPart + static_cast<std::size_t>(more), mesh);
    }
    return mesh;
}

}  // namespace packet::tools
