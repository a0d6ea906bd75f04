// The k-d tree that is built level by level: its planes, and what it is worth.
#include "configurations.h"
#include "generate.h"
#include "random.h"
#include "share.h"

#include "build/kd_bins.h"
#include "build/kd_masks.h"
#include "build/tree.h"

#include <packet/error.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace packet;
using namespace packet::test;

namespace {

/// Some references, and a cell of all of them.
struct Sample {
    std::vector<Reference> references;
    KdRange cell;

    void add(const Reference& r) {
        references.push_back(r);
        cell.bounds.extend(r.bounds());
        ++cell.count;
    }
};

/// Boxes on a coarse lattice, so that many begin, end or are flat in one plane; some leave gaps.
Sample random_sample(tools::Random& random, std::uint64_t most) {
    Sample out;
    const std::uint64_t count = 2 + random.next() % (most - 1);
    for (std::uint32_t id = 0; id < count; ++id) {
        const glm::vec3 lower = glm::floor(20.0f * random.point());
        out.add({lower, id, lower + glm::floor(2.5f * random.point())});
    }
    out.cell.spare = random.next() % (2 * count);
    return out;
}

struct Counted {
    double cost;
    bool is_allowed;
};

/// What a plane costs, from a look at every reference.
Counted count(const Sample& sample, const KdPlane& plane, const BuildOptions& options) {
    KdCounts counts;
    float end = -INFINITY, begin = INFINITY;
    for (const Reference& r : sample.references) {
        const int side = plane.side_of(r);
        if (side != 1) ++counts.side[0], end = std::max(end, r.upper[plane.axis]);
        if (side != 0) ++counts.side[1], begin = std::min(begin, r.lower[plane.axis]);
    }
    end = std::min(end, plane.position), begin = std::max(begin, plane.position);
    const KdCost cost(sample.cell, options);
    return {cost.cut(plane.axis, end, begin, counts), counts.allow_cut(sample.cell)};
}

/// The least cost over all planes.
double cheapest_cost(const Sample& sample, const BuildOptions& options) {
    double best = KdCost(sample.cell, options).leaf();
    for (const Reference& at : sample.references) {
        for (int i = 0; i < 12; ++i) {
            const int axis = i % 3;
            const float position = i / 6 == 0 ? at.lower[axis] : at.upper[axis];
            const Counted counted = count(sample, {0.0, position, axis, i / 3 % 2}, options);
            if (counted.is_allowed) best = std::min(best, counted.cost);
        }
    }
    return best;
}

double sah_cost(const TriangleMesh& mesh, KdBuild build) {
    BuildOptions options;
    options.accel = AccelKind::kKdSah;
    options.kd_build = build;
    return build_tree(mesh.view(), options).stats.sah_cost;
}

}  // namespace

TEST_CASE("masks find for every set what trying every plane finds") {
    tools::Random random(8);
    const BuildOptions options;
    int cuts = 0;
    for (int i = 0; i < 2000; ++i) {
        const Sample all = random_sample(random, kMaxSetSize);
        const KdMasks masks(all.references);
        const std::uint64_t wanted = random.next() | random.next();
        KdSet set = 0;
        Sample sample;
        sample.cell.spare = all.cell.spare;
        for (std::size_t r = 0; r < all.references.size(); ++r) {
            if ((wanted >> r & 1) == 0) continue;
            set |= KdSet{1} << r;
            sample.add(all.references[r]);
        }
        if (set == 0) continue;
        const KdPlane plane = masks.find_cheapest_plane(set, sample.cell, options);
        CHECK(plane.cost == cheapest_cost(sample, options));
        cuts += plane.is_cut();
    }
    CHECK(cuts > 1000);
}

TEST_CASE(
    "a plane found by bins is allowed, costs no more than they say and little more than any") {
    tools::Random random(9);
    const BuildOptions options;
    double excess = 0.0;
    int cuts = 0;
    for (int i = 0; i < 1000; ++i) {
        const Sample sample = random_sample(random, 300);
        KdBins bins;
        bins.add(sample.cell.bounds, sample.references);
        const KdPlane plane = find_cheapest_plane(bins, sample.cell, options);
        if (!plane.is_cut()) continue;
        const Counted counted = count(sample, plane, options);
        CHECK(counted.is_allowed);
        CHECK(counted.cost <= plane.cost * (1 + 1e-12));
        excess += counted.cost / cheapest_cost(sample, options) - 1.0;
        ++cuts;
    }
    CHECK(cuts > 700);
    // As many bins as there are places for planes: as good as trying all.
    CHECK(excess / cuts < 0.01);
}

TEST_CASE("bins of pieces add up to those of all") {
    tools::Random random(10);
    const Sample sample = random_sample(random, 1000);
    const std::span<const Reference> all = sample.references;
    KdBins want, got, second;
    want.add(sample.cell.bounds, all);
    got.add(sample.cell.bounds, all.first(all.size() / 3));
    second.add(sample.cell.bounds, all.subspan(all.size() / 3));
    got.join(second);
    for (int a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < kKdBinCount; ++b) {
            CHECK(got.axis(a)[b].start_count == want.axis(a)[b].start_count);
            CHECK(got.axis(a)[b].end_count == want.axis(a)[b].end_count);
            CHECK(got.axis(a)[b].first_start == want.axis(a)[b].first_start);
            CHECK(got.axis(a)[b].last_end == want.axis(a)[b].last_end);
        }
    }
}

TEST_CASE("a tree built level by level has at most 5% more SAH cost than one by sorted events") {
    for (const tools::SceneKind& kind : tools::kSceneKinds) {
        for (const std::size_t all : {200u, 5000u, 60000u}) {
            const std::size_t count = share_of(all, 5000);
            CAPTURE(kind.name);
            CAPTURE(count);
            const TriangleMesh mesh = kind.make(count, 3);
            const double sorted = sah_cost(mesh, KdBuild::kSorted);
            const double levels = sah_cost(mesh, KdBuild::kBreadthFirst);
            CHECK(levels <= 1.05 * sorted);
        }
    }
}

TEST_CASE("ways to build a k-d tree have names, and an unknown one lists them") {
    for (const KdBuildName& way : kd_build_names()) CHECK(parse_kd_build(way.name) == way.build);
    CHECK_THROWS_WITH_AS(
        (void)parse_kd_build("sideways"),
        "unknown way to build a k-d tree 'sideways'; valid are: sorted, breadth-first", Error);
}
