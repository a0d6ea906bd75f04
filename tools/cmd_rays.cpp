// packet rays: sets of rays to trace.
#include "commands.h"
#include "npy.h"
#include "options.h"
#include "progress.h"
#include "ray_kinds.h"

#include <packet/gltf.h>

#include <fmt/format.h>

#include <memory>
#include <string>

namespace packet::tools {
namespace {

struct RaysOptions {
    std::string scene, output;
    RayKind kind = RayKind::kPrimary;
    std::uint64_t seed = 1;
    CameraOptions camera;
    CommonOptions common;
};

void run(const RaysOptions& options) {
    OutputFile file(options.output);  // first, so that a bad name is told before the work is done
    Scene scene = load_gltf(options.scene).scene;
    const Camera camera(options.camera, scene.bounds());
    if (needs_commit(options.kind)) commit_visibly(scene, options.common.build);
    const std::vector<Ray> rays =
        make_rays(options.kind, scene, camera, options.seed, options.common.trace);
    write_rays(std::move(file), rays);
    print(fmt::format("{}: {} rays\n", options.output, rays.size()));
}

}  // namespace

void add_rays_command(CLI::App& program) {
    CLI::App& app = *program.add_subcommand("rays", "Make rays for a scene, one for each pixel");
    const auto options = std::make_shared<RaysOptions>();
    app.add_option("scene", options->scene, "The scene, .gltf or .glb")
        ->required()
        ->type_name("SCENE");
    add_name_option(app, "kind", "What rays", list_names(kRayKinds),
                    [options = options.get()](std::string_view name) {
                        options->kind = find_name("kind of rays", name, kRayKinds).value;
                    })
        ->required();
    app.add_option("-o,--output", options->output, "The rays")->required()->type_name("RAYS.npy");
    app.add_option("--seed", options->seed, "Other random numbers")->capture_default_str();
    add_camera_options(app, options->camera);
    add_common_options(app, options->common);
    app.callback([options] { run(*options); });
}

}  // namespace packet::tools
