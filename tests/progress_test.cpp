// Builds that tell how far they are, and are cancelled.
#include "configurations.h"
#include "generate.h"
#include "test_rays.h"

#include <packet/packet.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>

using namespace packet;
using namespace packet::test;

namespace {

/// fn(options) for every structure, on one thread and on two.
template <class Fn>
void for_each_build(Fn fn) {
    for (const Build& build : all_builds()) {
        for (const int threads : {1, 2}) {
            CAPTURE(build.name);
            CAPTURE(threads);
            BuildOptions options = build.options;
            options.threads = threads;
            fn(options);
        }
    }
}

/// Several meshes, one of them large enough for tasks of its own.
Scene make_test_scene() {
    Scene scene;
    scene.add_mesh(tools::make_city(9000, 1));
    scene.add_mesh(tools::make_soup(700, 2));
    for (std::uint32_t i = 0; i < 50; ++i) {
        glm::mat4x3 place(1.0f);
        place[3] = 30.0f * glm::vec3(i % 5, i / 5, 0);
        scene.add_instance(i % 2, place);
    }
    return scene;
}

std::vector<Hit> trace(const Scene& scene, std::span<const Ray> rays) {
    std::vector<Hit> hits(rays.size());
    trace_closest(scene, rays, hits);
    return hits;
}

}  // namespace

TEST_CASE("progress goes from 0 to 1, never back, and is told by one thread at a time") {
    for_each_build([](BuildOptions options) {
        Scene scene = make_test_scene();
        std::atomic<int> inside = 0, overlaps = 0;
        std::vector<float> told;
        options.progress = [&](float fraction) {
            overlaps += inside++ != 0;
            told.push_back(fraction);
            --inside;
            return true;
        };
        scene.commit(options);
        CHECK(overlaps == 0);
        CHECK(told.front() == 0.0f);
        CHECK(told.back() == 1.0f);
        CHECK(std::is_sorted(told.begin(), told.end()));
        CHECK(told.size() >= 8);
        CHECK(told[told.size() / 2] > 0.1f);
        CHECK(told[told.size() / 2] < 0.99f);
    });
}

TEST_CASE("a grid of trees tells of its cells' trees, which are most of the work") {
    Scene scene = make_scene(tools::make_soup(8000, 2));
    BuildOptions options;
    options.accel = AccelKind::kGridOfTrees;
    options.grid_density = 1.0f;  // 64 cells; laying out their lists is told of a dozen times
    options.threads = 1;
    int reports = 0;
    options.progress = [&](float) { return ++reports > 0; };
    scene.commit(options);
    CHECK(reports > 40);
}

TEST_CASE("a build is cancelled at any report, and leaves the scene as it was") {
    Scene scene = make_test_scene();
    scene.commit();
    const auto rays = random_rays(scene.bounds(), 500, 3);
    const std::vector<Hit> want = trace(scene, rays);
    const std::size_t bytes = scene.build_stats().bytes;
    for_each_build([&](BuildOptions options) {
        bool is_cancelled = true;
        int last = 0;
        for (; is_cancelled; ++last) {
            is_cancelled = false;
            int number = 0;
            options.progress = [&](float) { return number++ != last; };
            Scene copy = scene;
            try {
                copy.commit(options);
            } catch (const Error& error) {
                is_cancelled = true;
                CHECK(error.code() == ErrorCode::kCancelled);
                CHECK(number == last + 1);  // it is not asked again
                CHECK(copy.build_stats().bytes == bytes);
                CHECK(trace(copy, rays) == want);
            }
        }
        CHECK(last > 8);
    });
}

TEST_CASE("a scene that was never committed and is cancelled is still not committed") {
    Scene scene = make_test_scene();
    BuildOptions options;
    options.progress = [](float fraction) { return fraction < 0.5f; };
    CHECK_THROWS_WITH_AS(scene.commit(options), "the build was cancelled", Error);
    CHECK(!scene.committed());
    options.progress = nullptr;
    scene.commit(options);
    CHECK(scene.committed());
}

TEST_CASE("what a report throws comes out of commit") {
    for_each_build([](BuildOptions options) {
        for (const float limit : {0.0f, 0.1f, 0.5f, 0.9f, 1.0f}) {
            Scene scene = make_test_scene();
            options.progress = [&](float fraction) {
                if (fraction >= limit) throw std::runtime_error("mine");
                return true;
            };
            CHECK_THROWS_WITH_AS(scene.commit(options), "mine", std::runtime_error);
            CHECK(!scene.committed());
        }
    });
}

TEST_CASE("a tree is the same with and without reports") {
    for_each_build([](BuildOptions options) {
        Scene scene = make_test_scene();
        const auto rays = random_rays(scene.bounds(), 500, 4);
        scene.commit(options);
        const BuildStats want = scene.build_stats();
        options.progress = [](float) { return true; };
        scene.commit(options);
        CHECK(scene.build_stats().node_count == want.node_count);
        CHECK(scene.build_stats().sah_cost == want.sah_cost);
    });
}
