// The packet interface: active lanes get the oracle's hits, the others keep every bit.
#include "configurations.h"
#include "dispatch/dispatch.h"
#include "generate.h"
#include "oracle.h"
#include "scene/scene_accel.h"
#include "share.h"
#include "test_rays.h"

#include <doctest/doctest.h>

#include <algorithm>
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

/// By the interface, and thus by the best instruction set.
struct ByInterface {
    const Scene& scene;

    template <int N>
    LaneMask<N> trace(const RayPacket<N>& rays, LaneMask<N> active, HitPacket<N>& hits) const {
        trace_closest(scene, rays, active, hits);
        return trace_any(scene, rays, active);
    }
};

/// By the kernels of any instruction set.
struct ByKernels {
    const Scene& scene;
    const KernelTable& kernels;

    template <int N>
    LaneMask<N> trace(const RayPacket<N>& rays, LaneMask<N> active, HitPacket<N>& hits) const {
        const SceneView& view = scene.accel().view;
        if constexpr (N == 8) {
            kernels.closest8(view, rays, active.bits, hits);
            return {kernels.any8(view, rays, active.bits)};
        } else {
            kernels.closest16(view, rays, active.bits, hits);
            return {kernels.any16(view, rays, active.bits)};
        }
    }
};

template <int N, class By>
void check_masks(const By& by, const Oracle& oracle, std::uint64_t seed, int rounds) {
    tools::Random random(seed);
    for (int round = 0; round < rounds; ++round) {
        CAPTURE(round);
        CAPTURE(seed);
        const auto rays =
            random_rays(by.scene.bounds(), N, seed + static_cast<std::uint64_t>(round));
        LaneMask<N> active{static_cast<std::uint32_t>(random.next()) & LaneMask<N>::kAllBits};
        if (round < N) active = LaneMask<N>::first(round);
        const RayPacket<N> packet = pack<N>(rays, active);
        Sentinel<N> out;
        const LaneMask<N> occluded = by.trace(packet, active, out.hits);
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
    const Oracle oracle(scene);
    check_masks<8>(ByInterface{scene}, oracle, 1, 400);
    check_masks<16>(ByInterface{scene}, oracle, 2, 400);
}

TEST_CASE("masks hold in every structure, on every instruction set, in one mesh and in instances") {
    Scene instances;
    instances.add_mesh(tools::make_soup(60, 13));
    instances.add_mesh(tools::make_sphere(72));
    tools::Random random(14);
    for (std::uint32_t i = 0; i < 12; ++i) {
        glm::mat4x3 m;
        for (int column = 0; column < 3; ++column) m[column] = random.direction();
        m[3] = 3.0f * random.point();
        instances.add_instance(i % 2, m);
    }
    for (Scene scene : {make_scene(tools::make_soup(200, 15)), instances}) {
        const Oracle oracle(scene);
        for (const Build& build : all_builds()) {
            CAPTURE(build.name);
            scene.commit(build.options);
            for (const IsaId isa : cpu_isas()) {
                CAPTURE(to_string(isa));
                const ByKernels by{scene, select_kernels(isa)};
                const int rounds = static_cast<int>(share_of(60, 20));
                check_masks<8>(by, oracle, 3, rounds);
                check_masks<16>(by, oracle, 4, rounds);
            }
        }
    }
}

TEST_CASE("1 to 100 rays, in any number of whole and partial packets") {
    Scene scene = make_scene(tools::make_soup(300, 12));
    scene.commit();
    const Oracle oracle(scene);
    for (std::size_t count = 1; count <= 100; ++count) {
        const auto rays = random_rays(scene.bounds(), count, count);
        const auto want = oracle.closest(rays);
        for (const ModeName& mode : mode_names()) {
            TraceOptions options;
            options.mode = mode.mode;
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
