// Ours against Embree, an implementation of other hands, in its robust mode.
#include "agreement.h"
#include "camera.h"
#include "embree_reference.h"
#include "generate.h"
#include "ray_kinds.h"
#include "share.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace packet;
using namespace packet::bench;

namespace {

struct Tally {
    std::size_t rays = 0, hits = 0, tied = 0, borderline = 0, different = 0;
};

/// An image of a quarter of a million rays, or their share: smaller, and still all of the view.
int image_side() { return static_cast<int>(std::sqrt(test::share_of(500 * 500))); }

/// Rays that hit nothing in both are compared too, but say little: `hits` counts the others.
void compare(const TriangleMesh& mesh, const Scene& scene, const EmbreeScene& embree,
             tools::RayKind kind, Tally& tally) {
    tools::CameraOptions camera;
    camera.size = {image_side(), image_side()};
    const auto rays = tools::make_rays(kind, scene, tools::Camera(camera, scene.bounds()), 11);
    std::vector<Hit> ours(rays.size()), theirs(rays.size());
    trace_closest(scene, rays, ours);
    embree.trace_closest(EmbreeMode::k1, rays, theirs);
    const Agreement agreement = compare_hits(mesh.view(), rays, ours, theirs);
    for (const Hit& hit : ours) tally.hits += hit.is_hit();
    tally.rays += agreement.rays();
    tally.tied += agreement.tied;
    tally.borderline += agreement.borderline;
    tally.different += agreement.different;
}

void check_kind(tools::RayKind kind) {
    Tally tally;
    for (const char* name : {"terrain", "city", "hairball", "soup"}) {
        const TriangleMesh mesh = tools::generate(name, 50000, 3);
        Scene scene = make_scene(mesh);
        scene.commit();
        const EmbreeScene embree(mesh.view(), EmbreeQuality::kMedium, EmbreeTest::kRobust);
        compare(mesh, scene, embree, kind, tally);
    }
    MESSAGE(tally.rays << " rays, " << tally.hits << " hits, " << tally.tied << " ties, "
                       << tally.borderline << " on a silhouette by rounding, " << tally.different
                       << " different");
    CHECK(tally.rays == 4 * static_cast<std::size_t>(image_side() * image_side()));
    CHECK(tally.hits > tally.rays / 5);
    // An edge that only rounding decides may be decided either way.
    CHECK(tally.borderline <= 2);
    CHECK(tally.different == 0);
}

}  // namespace

TEST_CASE("a million coherent rays hit what they hit in Embree") {
    check_kind(tools::RayKind::kPrimary);
}
TEST_CASE("a million random rays hit what they hit in Embree") {
    check_kind(tools::RayKind::kRandom);
}
