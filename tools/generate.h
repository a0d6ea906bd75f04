// Generated scenes, for tests, benchmarks and demonstrations: each with the features that make real
// scenes of its sort fast or slow to trace, at any size.
#pragma once

#include <packet/mesh.h>

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace packet::tools {

/// More would not fit a .glb file, whose length is a 32-bit number.
inline constexpr std::size_t kMaxTriangles = 50'000'000;

// All take a wished number of triangles from 1 to kMaxTriangles, run in O(triangles) on one thread,
// and return the same mesh on every platform for the same seed.

/// Hills and ridges of fractal noise over a square, 2 triangles a grid cell, y up, 2 wide.
/// At most `triangle_count` triangles and short of it by less than the grid's side; at least 2.
[[nodiscard]] TriangleMesh make_terrain(std::size_t triangle_count, std::uint64_t seed);

/// Blocks of buildings of very different heights, with windows, roofs and streets, y up, in metres.
/// Everything is made of boxes: long walls beside tiny sills, and much empty space. At most
/// `triangle_count` triangles and short of it by less than 12; at least 2.
[[nodiscard]] TriangleMesh make_city(std::size_t triangle_count, std::uint64_t seed);

/// Thin curved strands around a ball of radius 1: boxes that overlap a lot and are mostly empty.
/// At most `triangle_count` triangles and short of it by less than 6; at least 6.
[[nodiscard]] TriangleMesh make_hairball(std::size_t triangle_count, std::uint64_t seed);

/// Unconnected triangles of very different sizes about the unit cube, exactly `triangle_count`.
[[nodiscard]] TriangleMesh make_soup(std::size_t triangle_count, std::uint64_t seed);

/// A sphere of radius 1, closed, with shared vertices and triangles that face outward: a ray from
/// inside always hits. The most triangles of the form 8 n^2 up to `triangle_count`; at least 8.
/// The seed changes nothing.
[[nodiscard]] TriangleMesh make_sphere(std::size_t triangle_count, std::uint64_t seed = 0);

/// A pot of tea 3 metres wide, of nearly all the triangles, in the middle of a square stadium of
/// 166 metres, y up. At most `triangle_count` triangles, short of it by less than 16 square roots
/// of it and 128; at least 114. The seed changes nothing.
[[nodiscard]] TriangleMesh make_stadium(std::size_t triangle_count, std::uint64_t seed = 0);

/// A kind of generated scene.
struct SceneKind {
    std::string_view name;
    TriangleMesh (*make)(std::size_t triangle_count, std::uint64_t seed);
};

inline constexpr SceneKind kSceneKinds[] = {{"terrain", make_terrain},   {"city", make_city},
                                            {"hairball", make_hairball}, {"soup", make_soup},
                                            {"sphere", make_sphere},     {"stadium", make_stadium}};

/// The scene of that name. Throws Error{kUnknownName} that lists the valid ones, and
/// Error{kBadValue} unless `triangle_count` is from 1 to kMaxTriangles.
[[nodiscard]] TriangleMesh generate(std::string_view kind, std::size_t triangle_count,
                                    std::uint64_t seed = 1);

}  // namespace packet::tools
