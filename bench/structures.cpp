// packet_structures: all structures side by side, as tables in Markdown, and a picture of each that
// shows how many nodes rays visit. docs/benchmarking.md shows what it prints.
#include "heat_pictures.h"
#include "markdown.h"
#include "program.h"
#include "structure_trial.h"

#include <packet/gltf.h>
#include <packet/isa.h>

#include <fmt/core.h>

#include <generate.h>
#include <options.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace packet::bench {
namespace {

// Debian's package assimp-testmodels.
constexpr const char* kModel =
    "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb";

struct Options {
    std::vector<std::filesystem::path> scenes;
    std::filesystem::path pictures = "out";
    std::size_t triangles = 200'000;
    int repeats = 3;
    tools::CameraOptions camera;
};

TrialScene load(const std::filesystem::path& path, const Options& options) {
    return {path.stem().string(), load_gltf(path).scene.flatten(), options.camera};
}

TrialScene make(std::string_view kind, const Options& options) {
    TrialScene scene{std::string(kind), tools::generate(kind, options.triangles), options.camera};
    if (kind == "stadium" && !options.camera.eye) {  // or the pot would be some pixels
        scene.camera.eye = {3.0f, 2.0f, 5.0f};
        scene.camera.at = {0.0f, 0.7f, 0.0f};
    }
    return scene;
}

std::vector<std::string> cells_of(const StructureFigures& figures) {
    std::vector<std::string> cells{std::string(figures.name), three_digits(figures.seconds_by_1),
                                   three_digits(figures.seconds_by_2),
                                   fmt::format("{:.0f}", figures.bytes_per_triangle),
                                   three_digits(figures.sah_cost)};
    for (const RayFigures* rays : {&figures.primary, &figures.diffuse}) {
        cells.push_back(three_digits(rays->mrays_per_s));
        cells.push_back(three_digits(rays->work.nodes_per_ray()));
        cells.push_back(three_digits(rays->work.triangles_per_ray()));
    }
    return cells;
}

enum class Pictures { kNone, kWritten };

void hold_trial(const TrialScene& scene, const Options& options, Pictures pictures) {
    const StructureTrial trial(scene, options.repeats);
    fmt::print("\n{}, {} triangles\n\n", scene.name, scene.mesh.triangles.size());
    print_table_head({"structure", "build s, 1 thread", "2 threads", "bytes/triangle", "SAH cost",
                      "primary Mrays/s", "nodes", "triangles", "diffuse Mrays/s", "nodes",
                      "triangles"});
    for (const StructureFigures& figures : trial.run()) print_cells(cells_of(figures));
    if (pictures == Pictures::kNone) return;
    const float most =
        write_heat_pictures(trial.nodes_per_pixel(), scene.camera.size, options.pictures);
    fmt::print(
        "\nNodes that rays visit in {}, from 0 (dark) by {:.0f} (red) to {:.0f} (pale): {}\n",
        scene.name, 0.25f * most, most, (options.pictures / "heat-*.png").string());
}

void run(const Options& options) {
    fmt::print("{} x {} rays by {}; medians of {} runs\n", options.camera.size.width,
               options.camera.size.height, to_string(default_isa()), options.repeats);
    Pictures pictures = Pictures::kWritten;  // of the first scene
    const auto hold_next = [&](const TrialScene& scene) {
        hold_trial(scene, options, std::exchange(pictures, Pictures::kNone));
    };
    if (options.scenes.empty()) {
        hold_next(load(kModel, options));
        for (const char* kind : {"terrain", "city", "hairball", "soup", "stadium"}) {
            hold_next(make(kind, options));
        }
    }
    for (const std::filesystem::path& path : options.scenes) hold_next(load(path, options));
}

void add_options(CLI::App& app, Options& options) {
    app.add_option("SCENE", options.scenes,
                   ".gltf or .glb files; without any, a model and generated scenes");
    app.add_option("--triangles", options.triangles, "of a generated scene")
        ->check(CLI::Range(std::size_t{1}, tools::kMaxTriangles))
        ->capture_default_str();
    app.add_option("--repeat", options.repeats, "timed builds and runs of each structure")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    app.add_option("--pictures", options.pictures, "the folder for pictures of the first scene")
        ->capture_default_str();
    options.camera.size = {256, 256};
    tools::add_camera_options(app, options.camera);
}

}  // namespace
}  // namespace packet::bench

// Adding options throws only if they contradict each other, which every run would show.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
    packet::bench::Options options;
    CLI::App app("Builds every structure over scenes and traces them", "packet_structures");
    packet::bench::add_options(app, options);
    return packet::bench::run_program(app, argc, argv, [&] {
        packet::bench::run(options);
        return 0;
    });
}
