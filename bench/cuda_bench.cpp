// packet_cuda_bench: how fast a CUDA device traces, mode by mode, and with how much work, as a
// table in Markdown. packet_cuda_work is the same program for the device that is emulated on the
// CPU: it counts the same work and has no times. docs/cuda.md shows what it prints.
#include "device_timing.h"
#include "markdown.h"
#include "program.h"

#include <packet/cuda.h>
#include <packet/error.h>
#include <packet/packet.h>

#include <camera.h>
#include <generate.h>
#include <ray_kinds.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace packet::bench {
namespace {

struct Options {
    std::size_t triangles = 1'000'000;
    int side = 1024;
    int repeats = 9;
};

constexpr cuda::DeviceMode kModes[] = {cuda::DeviceMode::kWarp, cuda::DeviceMode::kThread,
                                       cuda::DeviceMode::kSorted};
constexpr tools::RayKind kRays[] = {tools::RayKind::kPrimary, tools::RayKind::kDiffuse,
                                    tools::RayKind::kRandom};

/// The middle one. There is at least one.
double median(std::vector<double> values) {
    std::ranges::sort(values);
    return values[values.size() / 2];
}

/// Millions of rays a second, or a dash where the device has no clock.
std::string speed(const cuda::DeviceScene& device, std::span<const Ray> rays,
                  const cuda::DeviceTraceOptions& options, int repeats) {
    if (repeats == 0) return "-";
    const double seconds = median(cuda::time_traces(device, rays, options, repeats));
    return seconds > 0.0 ? three_digits(1e-6 * static_cast<double>(rays.size()) / seconds) : "-";
}

void print_mode(const cuda::DeviceScene& device, std::span<const Ray> rays,
                std::span<const Hit> want, std::string_view title, cuda::DeviceTraceOptions how,
                int repeats) {
    std::vector<Hit> hits(rays.size());
    TraceStats work;
    how.stats = &work;
    device.trace_closest(rays, hits, how);
    if (!std::ranges::equal(hits, want)) throw std::runtime_error("the device's hits are wrong");
    how.stats = nullptr;
    const double issued = static_cast<double>(work.lanes_issued) / static_cast<double>(work.rays);
    print_cells({std::string(title), std::string(cuda::to_string(how.mode)),
                 three_digits(work.nodes_per_ray()), three_digits(issued),
                 fmt::format("{:.0f}%", 100.0 * work.lane_utilization()),
                 three_digits(work.triangles_per_ray()), speed(device, rays, how, repeats)});
}

void print_scene(const tools::SceneKind& kind, const Options& options) {
    Scene scene = make_scene(kind.make(options.triangles, 1));
    BuildOptions build;
    build.keep_binary_nodes = true;  // which devices walk
    scene.commit(build);
    tools::CameraOptions view;
    view.size = {options.side, options.side};
    const tools::Camera camera(view, scene.bounds());
    const cuda::DeviceScene device(scene);
    for (const tools::RayKind rays_kind : kRays) {
        const std::vector<Ray> rays = tools::make_rays(rays_kind, scene, camera, 1);
        std::vector<Hit> want(rays.size());
        trace_closest(scene, rays, want);
        const int width = rays_kind == tools::RayKind::kPrimary ? options.side : 0;
        const auto name =
            std::ranges::find(tools::kRayKinds, rays_kind, &tools::Named<tools::RayKind>::value);
        const std::string title = fmt::format("{} {}", kind.name, name->name);
        for (const cuda::DeviceMode mode : kModes) {
            print_mode(device, rays, want, title, {mode, width, nullptr}, options.repeats);
        }
    }
}

/// Its name, or nothing, said on stdout, where there is none.
std::string find_device() {
    try {
        return cuda::device_name();
    } catch (const Error& error) {
        fmt::print("skipped: {}\n", error.what());
        return {};
    }
}

int run(const Options& options) {
    constexpr int kSkipped = 77;  // by custom what a test that could not run returns
    const std::string device = find_device();
    if (device.empty()) return kSkipped;
    fmt::print("{}: scenes of {} triangles, {} rays\n\n", device, options.triangles,
               options.side * options.side);
    print_table_head({"scene and rays", "mode", "nodes a ray", "lanes issued a ray", "lane use",
                      "triangles a ray", "Mrays/s"});
    for (const tools::SceneKind& kind : tools::kSceneKinds) print_scene(kind, options);
    return 0;
}

}  // namespace
}  // namespace packet::bench

// Adding options throws only if they contradict each other, which every run would show.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
    using namespace packet::bench;
    CLI::App app("How fast a CUDA device traces, and with how much work", "packet_cuda_bench");
    Options options;
    app.add_option("--triangles", options.triangles, "Of each scene")
        ->check(CLI::Range(1000, 10'000'000));
    app.add_option("--side", options.side, "Of the images whose pixels give the rays")
        ->check(CLI::Range(8, 4096));
    app.add_option("--repeat", options.repeats,
                   "Measure so often and report the median; 0 counts only")
        ->check(CLI::Range(0, 1000));
    return run_program(app, argc, argv, [&] { return run(options); });
}
