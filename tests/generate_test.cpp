// Generated scenes: as many triangles as promised, the same ones everywhere, and closed where they
// should be.
#include "generate.h"

#include <packet/error.h>

#include <doctest/doctest.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace packet::tools {
namespace {

/// FNV-1a over the bytes of both arrays.
std::uint64_t hash(const TriangleMesh& mesh) {
    std::uint64_t value = 0xCBF29CE484222325u;
    const auto add = [&](std::span<const std::byte> bytes) {
        for (const std::byte byte : bytes) {
            value = (value ^ static_cast<std::uint64_t>(byte)) * 0x100000001B3u;
        }
    };
    add(std::as_bytes(std::span(mesh.positions)));
    add(std::as_bytes(std::span(mesh.triangles)));
    return value;
}

/// The fewest triangles a kind may answer with.
std::size_t fewest(std::string_view kind, std::size_t wished) {
    const double n = static_cast<double>(wished);
    if (kind == "terrain")
        return static_cast<std::size_t>(std::max(n - std::sqrt(2.0 * n) - 2.0, 1.0));
    if (kind == "sphere")
        return static_cast<std::size_t>(std::max(n - 16.0 * std::sqrt(n / 8.0) - 8.0, 1.0));
    if (kind == "stadium")
        return static_cast<std::size_t>(std::max(n - 16.0 * std::sqrt(n) - 128.0, 1.0));
    if (kind == "city") return wished - std::min<std::size_t>(wished - 1, 11);
    if (kind == "hairball") return wished - std::min<std::size_t>(wished - 1, 5);
    return wished;
}

/// What a kind answers with at the least, however few are wished.
std::size_t smallest(std::string_view kind) { return generate(kind, 1).triangles.size(); }

TEST_CASE("every kind comes close to the number of triangles wished, and not above") {
    for (const SceneKind& kind : kSceneKinds) {
        for (const std::size_t wished : {1u, 2u, 5u, 13u, 14u, 100u, 1000u, 12345u, 300000u}) {
            CAPTURE(std::string(kind.name));
            CAPTURE(wished);
            const TriangleMesh mesh = generate(kind.name, wished);
            CHECK(mesh.triangles.size() <= std::max(wished, smallest(kind.name)));
            CHECK(mesh.triangles.size() >= fewest(kind.name, wished));
            CHECK(mesh.name == kind.name);
            CHECK_NOTHROW(validate(mesh.view()));
        }
    }
}

TEST_CASE("every vertex is finite and used") {
    for (const SceneKind& kind : kSceneKinds) {
        CAPTURE(std::string(kind.name));
        const TriangleMesh mesh = generate(kind.name, 5000, 3);
        std::vector<bool> used(mesh.positions.size());
        for (const glm::uvec3& triangle : mesh.triangles) {
            for (int corner = 0; corner < 3; ++corner) used[triangle[corner]] = true;
        }
        CHECK(std::count(used.begin(), used.end(), false) == 0);
        for (const glm::vec3& p : mesh.positions) {
            REQUIRE((std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)));
        }
    }
}

TEST_CASE("no triangle is flat to a line") {
    for (const SceneKind& kind : kSceneKinds) {
        CAPTURE(std::string(kind.name));
        const TriangleMesh mesh = generate(kind.name, 50000, 5);
        for (const glm::uvec3& t : mesh.triangles) {
            const glm::dvec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
            REQUIRE(glm::length(glm::cross(b - a, c - a)) > 0.0);
        }
    }
}

TEST_CASE("a seed gives the same scene on every platform") {
    const struct {
        std::string kind;
        std::uint64_t hash;
    } expected[] = {{"terrain", 0xC1CF5C1B844CFE6Fu},  {"city", 0x4742A6C8C127BEA6u},
                    {"hairball", 0x73BCEE1BEFF4BF51u}, {"soup", 0x959080B05F504C45u},
                    {"sphere", 0x6675DF85A228E485u},   {"stadium", 0xFE06342ECBE614DFu}};
    for (const auto& row : expected) {
        CAPTURE(row.kind);
        CHECK(hash(generate(row.kind, 10'000, 7)) == row.hash);
    }
}

TEST_CASE("another seed gives another scene") {
    for (const std::string kind : {"terrain", "city", "hairball", "soup"}) {
        CAPTURE(kind);
        CHECK(hash(generate(kind, 1000, 1)) != hash(generate(kind, 1000, 2)));
    }
}

TEST_CASE("a sphere is closed: every edge is shared by two triangles that run it both ways") {
    for (const std::size_t wished : {8u, 32u, 72u, 1000u, 20000u}) {
        CAPTURE(wished);
        const TriangleMesh mesh = make_sphere(wished);
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
        for (const glm::uvec3& t : mesh.triangles) {
            ++edges[{t.x, t.y}], ++edges[{t.y, t.z}], ++edges[{t.z, t.x}];
        }
        for (const auto& [edge, count] : edges) {
            REQUIRE(count == 1);
            REQUIRE(edges.contains({edge.second, edge.first}));
        }
        // Euler: a surface without holes or handles.
        CHECK(mesh.positions.size() + mesh.triangles.size() == edges.size() / 2 + 2);
    }
}

TEST_CASE("a sphere's vertices lie on it and its triangles face outward") {
    const TriangleMesh mesh = make_sphere(20000);
    for (const glm::vec3& p : mesh.positions) REQUIRE(glm::length(p) == doctest::Approx(1.0));
    for (const glm::uvec3& t : mesh.triangles) {
        const glm::vec3 &a = mesh.positions[t.x], &b = mesh.positions[t.y],
                        &c = mesh.positions[t.z];
        REQUIRE(glm::dot(glm::cross(b - a, c - a), a) > 0.0f);
    }
}

TEST_CASE("unknown kinds and impossible numbers are refused") {
    CHECK_THROWS_WITH_AS(
        (void)generate("teapot", 10),
        "unknown kind of scene 'teapot'; valid are: terrain, city, hairball, soup, sphere, stadium",
        Error);
    CHECK_THROWS_AS((void)generate("soup", 0), Error);
    CHECK_THROWS_AS((void)generate("soup", kMaxTriangles + 1), Error);
}

}  // namespace
}  // namespace packet::tools
