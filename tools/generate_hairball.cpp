// A ball of hair: thousands of thin tubes of three sides, each bending at random and held near a
// shell about the centre.
#include "generate.h"
#include "random.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace packet::tools {
namespace {

// The fewest that look solid from all around.
constexpr std::uint32_t kSides = 3;
constexpr std::size_t kTrianglesPerSegment = std::size_t{2} * kSides;
// Of a strand: bends look round.
constexpr std::size_t kSegments = 40;
// Of a strand, where the ball's radius is 1: most of a half turn.
constexpr float kLength = 2.5f;
// The radius of a strand if it is the only one. Many are thinner, and as much of the ball is hair.
constexpr float kCoverage = 0.08f;
// Turns in a segment, in radians or so: at random, and for a distance of 1 from the shell.
constexpr float kBend = 0.25f;
constexpr float kPull = 1.5f;

/// A place along a strand, with an axis across it.
struct Frame {
    glm::vec3 point, direction, across;
};

void advance(Frame& frame, float step, float shell, Random& random) {
    const float radius = glm::length(frame.point);
    const glm::vec3 outward = frame.point / radius;
    frame.direction = glm::normalize(frame.direction + kBend * random.direction() +
                                     kPull * (shell - radius) * outward);
    frame.point += step * frame.direction;
    const glm::vec3 across =
        frame.across - glm::dot(frame.across, frame.direction) * frame.direction;
    frame.across = glm::normalize(across);  // carried along, so that tubes do not twist
}

void add_ring(const Frame& frame, float radius, TriangleMesh& mesh) {
    constexpr float kSin60 = 0.866025404f;
    const glm::vec3 a = radius * frame.across;
    const glm::vec3 b = radius * glm::cross(frame.direction, frame.across);
    mesh.positions.push_back(frame.point + a);
    mesh.positions.push_back(frame.point - 0.5f * a + kSin60 * b);
    mesh.positions.push_back(frame.point - 0.5f * a - kSin60 * b);
}

/// The sides between the last two rings.
void add_sides(TriangleMesh& mesh) {
    const auto end = static_cast<std::uint32_t>(mesh.positions.size());
    const std::uint32_t from = end - 2 * kSides, to = end - kSides;
    for (std::uint32_t side = 0; side < kSides; ++side) {
        const std::uint32_t next = (side + 1) % kSides;
        mesh.triangles.emplace_back(from + side, from + next, to + side);
        mesh.triangles.emplace_back(to + side, from + next, to + next);
    }
}

void add_strand(std::size_t segments, float radius, Random random, TriangleMesh& mesh) {
    const float shell = random.uniform(0.6f, 1.0f);
    Frame frame;
    frame.point = shell * random.direction();
    frame.direction = random.direction();
    frame.across = glm::normalize(glm::cross(frame.direction, random.direction()));
    const float step = kLength / static_cast<float>(segments);
    add_ring(frame, radius, mesh);
    for (std::size_t segment = 1; segment <= segments; ++segment) {
        advance(frame, step, shell, random);
        const float along = static_cast<float>(segment) / static_cast<float>(segments);
        add_ring(frame, radius * (1.0f - 0.8f * along), mesh);  // hair ends in a tip
        add_sides(mesh);
    }
}

}  // namespace

TriangleMesh make_hairball(std::size_t triangle_count, std::uint64_t seed) {
    const std::size_t segments = std::max<std::size_t>(triangle_count / kTrianglesPerSegment, 1);
    const std::size_t strands = std::max<std::size_t>(segments / kSegments, 1);
    const float radius = kCoverage / std::sqrt(static_cast<float>(strands));

    TriangleMesh mesh;
    mesh.name = "hairball";
    mesh.positions.reserve(kSides * (segments + strands));
    mesh.triangles.reserve(kTrianglesPerSegment * segments);
    for (std::size_t strand = 0; strand < strands; ++strand) {
        // Shares that differ by at most one and add up to all segments.
        const std::size_t share = segments * (strand + 1) / strands - segments * strand / strands;
        add_strand(share, radius, Random(seed, strand), mesh);
    }
    return mesh;
}

}  // namespace packet::tools
