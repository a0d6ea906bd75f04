// Whole traces: every mode by every instruction set on small scenes, and on every structure of a
// larger one.
#include "course.h"
#include "micro.h"

#include <fmt/core.h>

#include <camera.h>
#include <generate.h>
#include <ray_kinds.h>

#include <cstddef>
#include <string_view>

namespace packet::bench {
namespace {

// Few enough to stay in the cache, so that it is the kernels that are measured,
constexpr std::size_t kSmall = 20'000;
// and more than the second level's holds.
constexpr std::size_t kLarge = 200'000;
constexpr tools::ImageSize kImageSize{256, 256};

Course make_course(std::string_view scene_kind, std::size_t triangles, AccelKind accel,
                   tools::RayKind ray_kind) {
    Scene scene = make_scene(tools::generate(scene_kind, triangles));
    BuildOptions options;
    options.accel = accel;
    options.treelet_bytes = kUsualTreeletBytes;
    scene.commit(options);
    tools::CameraOptions camera;
    camera.size = kImageSize;
    std::vector<Ray> rays = make_rays(ray_kind, scene, {camera, scene.bounds()}, 1);
    const int width = ray_kind == tools::RayKind::kPrimary ? kImageSize.width : 0;
    return {std::move(scene), std::move(rays), width};
}

}  // namespace

void add_trace_benchmarks() {
    for (const std::string_view scene : {"sphere", "terrain", "soup"}) {
        for (const auto& rays : tools::kRayKinds) {
            const Lazy<Course> course(
                [=] { return make_course(scene, kSmall, AccelKind::kBvh, rays.value); });
            for (const ModeName& mode : mode_names()) {
                for (const IsaId isa : built_isas()) {
                    add_course(fmt::format("trace/{}/{}/{}/{}", scene, rays.name, mode.name,
                                           to_string(isa)),
                               course, mode.mode, isa);
                }
            }
        }
    }
}

void add_walk_benchmarks() {
    for (const AccelName& accel : accel_names()) {
        for (const auto& rays : tools::kRayKinds) {
            if (rays.value != tools::RayKind::kPrimary && rays.value != tools::RayKind::kDiffuse) {
                continue;
            }
            const Lazy<Course> course(
                [=] { return make_course("city", kLarge, accel.kind, rays.value); });
            for (const ModeName& mode : mode_names()) {
                add_course(fmt::format("walk/{}/{}/{}", accel.name, rays.name, mode.name), course,
                           mode.mode);
            }
        }
    }
}

}  // namespace packet::bench
