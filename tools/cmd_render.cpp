// packet render: an image of a scene.
#include "commands.h"
#include "cuda_tracer.h"
#include "options.h"
#include "progress.h"
#include "render.h"

#include <packet/gltf.h>

#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <string>

namespace packet::tools {
namespace {

constexpr int kMaxSamples = 65536;  // more would not show in 8 bits

struct RenderOptions {
    std::string scene, output;
    const Shading* shading = &shadings().front();
    int samples = 0;
    CameraOptions camera;
    CommonOptions common;
    Named<Device> device = kDevices[0];
};

std::unique_ptr<const Tracer> make_tracer(const Scene& scene, const RenderOptions& options) {
    const TraceOptions& trace = options.common.trace;
    if (options.device.value == Device::kCpu) return std::make_unique<CpuTracer>(scene, trace);
    return std::make_unique<CudaTracer>(scene, device_mode(trace.mode));
}

void run(const RenderOptions& options) {
    if (options.device.value == Device::kCuda)
        (void)cuda::device_name();    // throws if there is none
    OutputFile file(options.output);  // first, so that a bad name is told before the work is done
    Scene scene = load_gltf(options.scene).scene;
    const Camera camera(options.camera, scene.bounds());
    commit_visibly(scene, build_options_for(options.device.value, options.common.build));

    const auto start = std::chrono::steady_clock::now();
    const Image image =
        render(scene, camera, *options.shading, options.samples, *make_tracer(scene, options));
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    write_png(std::move(file), image);
    print(fmt::format("{}: {} x {} pixels, {}, {:.2f} s\n", options.output, image.size.width,
                      image.size.height, options.shading->name, seconds.count()));
}

}  // namespace

void add_render_command(CLI::App& program) {
    CLI::App& app = *program.add_subcommand("render", "Render an image of a scene");
    const auto options = std::make_shared<RenderOptions>();
    app.add_option("scene", options->scene, "The scene, .gltf or .glb")
        ->required()
        ->type_name("SCENE");
    app.add_option("-o,--output", options->output, "The image")->required()->type_name("IMAGE.png");
    add_name_option(app, "--shading", "What is shown", list_names(shadings()),
                    [options = options.get()](std::string_view name) {
                        options->shading = &find_name("shading", name, shadings());
                    })
        ->default_str("normal");
    app.add_option("--samples", options->samples, "Rays a pixel, 0 for the shading's own number")
        ->check(CLI::Range(0, kMaxSamples))
        ->capture_default_str();
    add_camera_options(app, options->camera);
    add_common_options(app, options->common);
    add_device_option(app, options->device);
    app.callback([options] { run(*options); });
}

}  // namespace packet::tools
