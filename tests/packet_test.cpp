// The packet interface: active lanes get the oracle's hits, the others keep every bit.
#include "generate.h"
#include "oracle.h"
#include "test_rays.h"

#include <doctest/doctest.h>

#include <cstring>

using namespace packet;
using namespace packet::test;

namespace {

template <int N>
struct Sentinel {
    HitPacket<N> hits;
    Sentinel() { std::memset(static_cast<void*>(&hits), 0xA5, sizeof(hits)); }
    [[nodiscard]] bool untouched(int lane) const {
        const Hit hit = hits.get(lane);
        unsigned char want[sizeof(Hit)];
        std::memset(want, 0xA5, sizeof(want));
        return std::memcmp(&hit, want, sizeof(want)) == 0;
    }
};

/// Inactive lanes of the input hold signalling garbage, to show that nothing depends on them.
template <int N>
RayPacket<N> pack(std::span<const Ray> rays, LaneMask<N> active) {
    RayPacket<N> packet;
    std::memset(static_cast<void*>(&packet), 0xFF, sizeof(packet));
    for (int lane = 0; lane < N; ++lane) {
        if (active.test(lane)) packet.set(lane, rays[static_cast<std::size_t>(lane)]);
    }
    return packet;
}

template <int N>
void check_masks(const Scene& scene, std::uint64_t seed) {
    tools::Random random(seed);
    const Oracle oracle(scene);
    for (int round = 0; round < 400; ++round) {
        CAPTURE(round);
        CAPTURE(seed);
        const auto rays = random_rays(scene.bounds(), N, seed + static_cast<std::uint64_t>(round));
        LaneMask<N> active{static_cast<std::uint32_t>(random.next()) & LaneMask<N>::kAllBits};
        if (round < N) active = LaneMask<N>::first(round);
        const RayPacket<N> packet = pack<N>(rays, active);
        Sentinel<N> out;
        trace_closest(scene, packet, active, out.hits);
        const LaneMask<N> occluded = trace_any(scene, packet, active);
        for (int lane = 0; lane < N; ++lane) {
            CAPTURE(lane);
            const Hit want = oracle.closest(rays[static_cast<std::size_t>(lane)]);
            if (active.test(lane)) {
                CHECK(out.hits.get(lane) == want);
                CHECK(occluded.test(lane) == want.is_hit());
            } else {
                CHECK(out.untouched(lane));
                CHECK(!occluded.test(lane));
            }
        }
    }
}

}  // namespace

TEST_CASE("packets of 8 and 16 lanes under random masks leave inactive lanes as they were") {
    Scene scene = make_scene(tools::make_soup(300, 11));
    scene.commit();
    check_masks<8>(scene, 1);
    check_masks<16>(scene, 2);
}

TEST_CASE("1 to 100 rays, in any number of whole and partial packets") {
    Scene scene = make_scene(tools::make_soup(300, 12));
    scene.commit();
    const Oracle oracle(scene);
    for (std::size_t count = 1; count <= 100; ++count) {
        const auto rays = random_rays(scene.bounds(), count, count);
        const auto want = oracle.closest(rays);
        for (const Mode mode : {Mode::kSingle, Mode::kPacket8, Mode::kPacket16}) {
            TraceOptions options;
            options.mode = mode;
            std::vector<Hit> hits(count + 1);
            hits[count].t = -7.0f;
            trace_closest(scene, rays, std::span(hits).first(count), options);
            CHECK(std::equal(want.begin(), want.end(), hits.begin()));
            CHECK(hits[count].t == -7.0f);
        }
    }
}

TEST_CASE("a single ray is answered like any other") {
    Scene scene = make_scene(tools::make_sphere(500));
    scene.commit();
    const Oracle oracle(scene);
    for (const Ray& ray : random_rays(scene.bounds(), 200, 3)) {
        CHECK(trace_closest(scene, ray) == oracle.closest(ray));
        CHECK(trace_any(scene, ray) == oracle.any(ray));
    }
}

TEST_CASE("default rays, hits and masks have every field set") {
    const Hit hit;
    CHECK(!hit.is_hit());
    CHECK(hit.mesh_id == kInvalidId);
    const Ray8 packet;
    CHECK(packet.get(7).tfar == std::numeric_limits<float>::infinity());
    CHECK(packet.get(0).dir.z == 1.0f);
    CHECK(Hit16().get(15) == Hit());
    CHECK(LaneMask<16>::first(3).bits == 7u);
    CHECK(LaneMask<32>::all().bits == 0xFFFFFFFFu);
    CHECK(LaneMask<8>().bits == 0xFFu);
}
