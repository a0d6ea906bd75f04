// The quick verdict of any-hit rays about triangles, against the test that it stands for.
#include "kernels/isa_types.h"
#include "kernels/triangle.h"
#include "random.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

using namespace packet;

namespace {

using Isa = isa::Scalar;
using F = Float<1, Isa>;

/// A triangle in lane 0 of a block.
struct Target {
    TriangleBlock block = {};
    TreeView tree = {};  ///< whose box is the triangle's

    explicit Target(const glm::vec3 (&corner)[3]) {
        for (int axis = 0; axis < 3; ++axis) {
            for (int i = 0; i < 3; ++i) block.v[i][axis][0] = corner[i][axis];
            tree.lower[axis] = std::min({corner[0][axis], corner[1][axis], corner[2][axis]});
            tree.upper[axis] = std::max({corner[0][axis], corner[1][axis], corner[2][axis]});
        }
    }
};

struct Outcome {
    bool is_candidate = false, hits = false, verdict_hits = false, verdict_misses = false;
    float t = 0.0f;
};

Outcome meet(const Target& target, const glm::vec3& org, const glm::vec3& dir, float tnear,
             float tfar) {
    RayLanes<1, Isa> ray;
    for (int a = 0; a < 3; ++a) ray.org[a] = org[a], ray.dir[a] = dir[a];
    ray.tnear = tnear, ray.tfar = tfar;
    Outcome out;
    if (none(usable(ray))) return out;
    PreparedRays<1, Isa> prepared;
    prepare(prepared, target.tree, ray, 1);
    const SameTriangle triangle{target.block, 0};
    const auto sheared = shear<Directions::kShared>(prepared.shear, triangle);
    const auto candidates = sheared.may_hit();
    out.is_candidate = any(candidates);
    if (!out.is_candidate) return out;
    const auto hits = decide_hits(sheared, prepared.hit, F(tfar), candidates, triangle);
    const auto verdicts = judge(sheared, prepared.hit, F(tfar));
    out.hits = any(hits.hit);
    out.t = hits.t.r[0];
    out.verdict_hits = any(verdicts.hit);
    out.verdict_misses = any(verdicts.miss);
    return out;
}

/// Triangles of any size and place: fat ones, slivers, and some in a plane of the axes.
void make_triangle(tools::Random& random, float scale, glm::vec3 (&corner)[3]) {
    const float far = std::ldexp(scale, static_cast<int>(random.next() % 8));
    const glm::vec3 place =
        random.next() % 2 == 0 ? glm::vec3(0.0f) : far * (2.0f * random.point() - 1.0f);
    for (glm::vec3& p : corner) p = place + scale * (2.0f * random.point() - 1.0f);
    if (random.next() % 4 == 0) {
        const float thin = std::ldexp(1.0f, -static_cast<int>(random.next() % 24));
        corner[2] = 0.5f * (corner[0] + corner[1]) + thin * (corner[2] - corner[0]);
    }
    if (random.next() % 4 == 0) {
        const auto axis = static_cast<int>(random.next() % 3);
        corner[1][axis] = corner[2][axis] = corner[0][axis];
    }
}

/// A ray that meets the triangle within it, on an edge or at a corner, or grazes it.
std::pair<glm::vec3, glm::vec3> aim_at(tools::Random& random, const glm::vec3 (&corner)[3],
                                       float scale) {
    float u = random.uniform(), v = random.uniform();
    if (u + v > 1.0f) u = 1.0f - u, v = 1.0f - v;
    if (random.next() % 4 == 0) u = 0.0f;
    if (random.next() % 8 == 0) v = 1.0f - u;
    const glm::vec3 point = corner[0] + u * (corner[1] - corner[0]) + v * (corner[2] - corner[0]);
    glm::vec3 dir = random.direction() * random.uniform(0.1f, 10.0f);
    if (random.next() % 4 == 0) {
        const float off = std::ldexp(1.0f, -static_cast<int>(random.next() % 24));
        dir = (corner[1] - corner[0]) / scale + off * dir;
    }
    if (random.next() % 8 == 0) dir[static_cast<int>(random.next() % 3)] = 0.0f;
    // At the triangle, as rays that start on it, or a way before it.
    const float way = random.next() % 2 == 0
                          ? 0.0f
                          : scale * random.uniform(-2.0f, 2.0f) *
                                std::ldexp(1.0f, -static_cast<int>(random.next() % 24));
    return {point - way * dir, dir};
}

/// Near `t`, from its neighbours on.
float near(tools::Random& random, float t, float scale) {
    switch (random.next() % 4) {
        case 0: return t;
        case 1: return std::nextafter(t, random.next() % 2 == 0 ? -1e30f : 1e30f);
        default:
            return t + scale * random.uniform(-1.0f, 1.0f) *
                           std::ldexp(1.0f, -static_cast<int>(random.next() % 28));
    }
}

}  // namespace

TEST_CASE("the verdict about a triangle is that of the test it stands for") {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    constexpr int kTrials = 1'000'000;
    tools::Random random(11);
    int candidates = 0, hit = 0, missed = 0, wrong = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
        // Mostly sizes as scenes have them, and some that under- or overflow.
        const int exponent = trial % 8 == 0 ? static_cast<int>(random.next() % 240) - 120
                                            : static_cast<int>(random.next() % 24) - 12;
        const float scale = std::ldexp(1.0f, exponent);
        glm::vec3 corner[3];
        make_triangle(random, scale, corner);
        const auto [org, dir] = aim_at(random, corner, scale);
        const Target target(corner);
        const float t = meet(target, org, dir, -kInfinity, kInfinity).t;
        float tnear = -kInfinity, tfar = kInfinity;
        if (random.next() % 4 != 0) tnear = near(random, t, scale);
        if (random.next() % 4 != 0) tfar = near(random, t, scale);
        if (!(tnear <= tfar)) continue;
        const Outcome outcome = meet(target, org, dir, tnear, std::min(tfar, kLargestFloat));
        candidates += outcome.is_candidate ? 1 : 0;
        if (!outcome.is_candidate) continue;
        hit += outcome.verdict_hits ? 1 : 0;
        missed += outcome.verdict_misses ? 1 : 0;
        wrong += outcome.verdict_hits && !outcome.hits ? 1 : 0;
        wrong += outcome.verdict_misses && outcome.hits ? 1 : 0;
    }
    CHECK(wrong == 0);
    CHECK(candidates > kTrials / 4);
    CHECK(hit > candidates / 8);
    CHECK(missed > candidates / 16);
    MESSAGE(candidates << " may hit: " << hit << " do and " << missed << " do not for sure");
}

TEST_CASE("a verdict is reached where a hit is not near either end of the ray") {
    const glm::vec3 corner[3] = {{-1.0f, -1.0f, 5.0f}, {2.0f, -1.0f, 5.5f}, {-1.0f, 2.0f, 4.0f}};
    const Target target(corner);
    const glm::vec3 org(0.1f, -0.2f, 0.0f), dir(0.01f, 0.02f, 1.0f);
    CHECK(meet(target, org, dir, 0.0f, 10.0f).verdict_hits);
    CHECK(meet(target, org, dir, 0.0f, 3.0f).verdict_misses);
    CHECK(meet(target, org, dir, 6.0f, 10.0f).verdict_misses);
    CHECK(meet(target, org, -dir, 0.0f, 10.0f).verdict_misses);
}
