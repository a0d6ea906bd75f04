// What is computed once a ray.
#include "kernels/ray_setup.h"
#include "random.h"
#include "test_rays.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>

using namespace packet;
using namespace packet::test;

namespace {

using Isa = isa::Scalar;
constexpr int kLanes = 8;
using F = Float<kLanes, Isa>;

RayLanes<kLanes, Isa> lanes_of(const Ray* rays) {
    RayLanes<kLanes, Isa> out;
    for (int i = 0; i < kLanes; ++i) {
        for (int a = 0; a < 3; ++a) {
            out.org[a].r[i] = rays[i].org[a];
            out.dir[a].r[i] = rays[i].dir[a];
        }
        out.tnear.r[i] = rays[i].tnear;
        out.tfar.r[i] = rays[i].tfar;
    }
    return out;
}

TreeView tree_of(const Bounds3f& bounds) {
    TreeView tree;
    for (int a = 0; a < 3; ++a) tree.lower[a] = bounds.lower[a], tree.upper[a] = bounds.upper[a];
    return tree;
}

bool same_bits(const F& a, const F& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace

TEST_CASE("boxes are grown by the farthest corner, wherever rays start") {
    tools::Random random(6);
    for (int round = 0; round < 2000; ++round) {
        const float size = std::ldexp(1.0f, static_cast<int>(random.next() % 240) - 120);
        const glm::vec3 one = size * (random.point() - 0.5f),
                        other = size * (random.point() - 0.5f);
        const TreeView tree = tree_of({glm::min(one, other), glm::max(one, other)});
        std::vector<Ray> rays(kLanes);
        for (Ray& ray : rays) {
            const float far = std::ldexp(size, static_cast<int>(random.next() % 8) - 4);
            ray.org = far * (2.0f * random.point() - 1.0f);
            ray.dir = random.direction();
        }
        const RayLanes<kLanes, Isa> lanes = lanes_of(rays.data());
        F reach(0.0f);
        for (int a = 0; a < 3; ++a) {
            reach = max(reach, abs(F(tree.lower[a]) - lanes.org[a]));
            reach = max(reach, abs(F(tree.upper[a]) - lanes.org[a]));
        }
        CHECK(same_bits(box_growth(tree, lanes), reach * F(tree.slack)));
    }
}

TEST_CASE("rays that are not steep are prepared as steep ones are, to the bit") {
    tools::Random random(7);
    int plain = 0, too_steep = 0, too_far = 0;
    for (int round = 0; round < 4000; ++round) {
        const bool is_huge = round % 4 == 2;
        const int exponent = static_cast<int>(random.next() % 120) - 60;
        const float size = std::ldexp(1.0f, is_huge ? 110 + exponent / 10 : exponent);
        const Bounds3f box = {glm::vec3(-size), glm::vec3(size) * (1.0f + random.point())};
        const TreeView tree = tree_of(box);
        std::vector<Ray> rays = random_rays(box, kLanes + 1, random.next());
        Ray* const first = rays.data() + 1;  // the one before goes along an axis
        float& x = first->dir[round / 4 % 3];
        if (round % 4 == 0) {
            x *= std::ldexp(1.0f, -static_cast<int>(random.next() % 64));
        } else if (round % 4 == 1) {
            x = 0.0f;
        } else if (is_huge) {
            x *= 0x1p-26f;
        }
        const RayLanes<kLanes, Isa> lanes = lanes_of(first);
        PreparedRays<kLanes, Isa> prepared;
        prepare(prepared, tree, lanes, (1u << kLanes) - 1);

        const F(&reciprocal)[3] = prepared.hit.reciprocal;
        const F least = min(abs(reciprocal[0]), min(abs(reciprocal[1]), abs(reciprocal[2])));
        const F limit = min(F(kLargestFloat), least * F(0x1p32f));
        PreparedRays<kLanes, Isa> other = prepared;
        prepare_steep_nodes(other, lanes, box_growth(tree, lanes), limit);
        bool is_bounded = false, is_open = false;
        for (int a = 0; a < 3; ++a) {
            CHECK(same_bits(prepared.inv_dir[a], other.inv_dir[a]));
            CHECK(same_bits(prepared.shift[0][a], other.shift[0][a]));
            CHECK(same_bits(prepared.shift[1][a], other.shift[1][a]));
            is_bounded = is_bounded || any(limit < abs(reciprocal[a]));
            is_open = is_open || any(other.inv_dir[a] == F(0.0f));
        }
        plain += prepared.is_steep ? 0 : 1;
        too_steep += is_bounded ? 1 : 0;
        too_far += is_open && !is_bounded ? 1 : 0;
        if (is_bounded || is_open) CHECK(prepared.is_steep);

        const ExitOrigins<kLanes, Isa> exits(prepared, tree, lanes);
        const F growth = box_growth(tree, lanes);
        for (int a = 0; a < 3; ++a) {
            for (int i = 0; i < kLanes; ++i) {
                const float inv_dir = prepared.inv_dir[a].r[i];
                const float more = node_growth(growth, lanes.org[a]).r[i];
                for (int side = 0; side < 2; ++side) {
                    const float outward = side == 0 ? 1.0f : -1.0f;
                    const float expected = inv_dir == reciprocal[a].r[i]
                                               ? prepared.hit.org[side][a].r[i]
                                           : inv_dir == 0.0f ? outward * INFINITY
                                                             : lanes.org[a].r[i] + outward * more;
                    CHECK(exits.org[side][a].r[i] == expected);
                }
            }
        }
    }
    CHECK(plain > 500);
    CHECK(too_steep > 500);
    CHECK(too_far > 200);
}

TEST_CASE("packets with one octant and longest axis are prepared as rays of any are") {
    tools::Random random(8);
    const TreeView tree = tree_of({glm::vec3(-1.0f), glm::vec3(1.0f)});
    int shared = 0, mixed = 0;
    for (int round = 0; round < 2000; ++round) {
        const glm::vec3 towards = random.direction();
        std::vector<Ray> rays(kLanes);
        for (Ray& ray : rays) {
            ray.org = 2.0f * random.point() - 1.0f;
            ray.dir = towards * random.uniform(0.1f, 3.0f);
            ray.dir.x *= random.uniform(0.99f, 1.0f);
        }
        if (round % 8 == 0) rays[3].dir.y = -rays[3].dir.y;
        const RayLanes<kLanes, Isa> lanes = lanes_of(rays.data());
        PreparedRays<kLanes, Isa> together, alone;
        prepare(together, tree, lanes, (1u << kLanes) - 1);
        prepare_boxes(alone, tree, lanes);
        prepare_shear(alone, lanes);
        const bool is_shared = together.directions == Directions::kShared;
        (is_shared ? shared : mixed) += 1;
        CHECK(same_bits(together.shear.shear_x, alone.shear.shear_x));
        CHECK(same_bits(together.shear.shear_y, alone.shear.shear_y));
        CHECK(same_bits(together.hit.scale_z, alone.hit.scale_z));
        CHECK(same_bits(together.speed, alone.speed));
        const Float3<kLanes, Isa> org = rotate_axes(alone.shear, lanes.org);
        CHECK(same_bits(together.shear.org[0], is_shared ? org.x : lanes.org[0]));
        CHECK(same_bits(together.shear.org[1], is_shared ? org.y : lanes.org[1]));
        CHECK(same_bits(together.shear.org[2], is_shared ? org.z : lanes.org[2]));
        for (int a = 0; a < 3; ++a) {
            const int near = together.near_side[a];
            CHECK(near == (is_shared && towards[a] < 0.0f ? 1 : 0));
            CHECK(same_bits(together.inv_dir[a], alone.inv_dir[a]));
            CHECK(same_bits(together.shift[near][a], alone.shift[0][a]));
            CHECK(same_bits(together.shift[1 - near][a], alone.shift[1][a]));
        }
        if (!is_shared) {
            for (int i = 0; i < 3; ++i) CHECK(together.shear.axis[i] == i);
        }
    }
    CHECK(shared > 1000);
    CHECK(mixed > 200);
}

TEST_CASE("rays are usable if their numbers are finite, in order, and go somewhere") {
    constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = NAN;
    const Ray good = {{1.0f, 2.0f, 3.0f}, 0.0f, {0.0f, -1.0f, 1e30f}, kInfinity};
    const auto is_usable = [](const Ray& ray) {
        const std::vector<Ray> rays(kLanes, ray);
        return usable(lanes_of(rays.data())).bits() == (1u << kLanes) - 1;
    };
    CHECK(is_usable(good));
    for (int a = 0; a < 3; ++a) {
        for (const float bad : {kInfinity, -kInfinity, kNan}) {
            Ray ray = good;
            ray.org[a] = bad;
            CHECK(!is_usable(ray));
            ray = good;
            ray.dir[a] = bad;
            CHECK(!is_usable(ray));
        }
        Ray ray = good;
        ray.org[a] = -std::numeric_limits<float>::max();
        ray.dir[a] = std::numeric_limits<float>::max();
        CHECK(is_usable(ray));
        ray.dir = glm::vec3(0.0f);
        ray.dir[a] = std::numeric_limits<float>::min();
        CHECK(is_usable(ray));
        ray.dir[a] = std::numeric_limits<float>::denorm_min();
        CHECK(!is_usable(ray));
    }
    Ray ray = good;
    ray.tnear = kNan;
    CHECK(!is_usable(ray));
    ray = good, ray.tfar = kNan;
    CHECK(!is_usable(ray));
    ray = good, ray.tnear = 2.0f, ray.tfar = 1.0f;
    CHECK(!is_usable(ray));
    ray.tfar = 2.0f;
    CHECK(is_usable(ray));
}
