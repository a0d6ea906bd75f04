// packet_bench: traces scenes with our kernels and with Embree, on the same rays, side by side.
// docs/benchmarking.md says how it measures and how to read it.
#include "program.h"
#include "report.h"

#include <packet/gltf.h>
#include <packet/scene.h>
#include <packet/trace.h>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include <camera.h>
#include <names.h>
#include <options.h>
#include <ray_kinds.h>
#include <timing.h>

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace packet::bench {
namespace {

std::vector<std::string> all_ray_kinds() {
    std::vector<std::string> names;
    for (const auto& row : tools::kRayKinds) names.emplace_back(row.name);
    return names;
}

struct Options {
    std::vector<std::filesystem::path> scenes;
    std::vector<int> threads{1};
    std::vector<std::string> rays = all_ray_kinds();
    BuildOptions build;
    tools::CameraOptions camera;
    int repeats = 5;
    bool robust = false;
    bool json = false;
};

/// One scene as both sides hold it. Embree's trees are of the qualities it is fastest with.
class Arena {
public:
    Arena(const std::filesystem::path& path, const BuildOptions& build, EmbreeTest test)
        : scene_(make_scene(load_gltf(path).scene.flatten())) {
        report_.scene = path.filename().string();
        report_.triangle_count = mesh().triangles.size();
        const double seconds = tools::seconds_of([&] { scene_.commit(build); });
        report_.builds.push_back({"ours", seconds, scene_.build_stats().bytes});
        for (const ModeName& mode : mode_names()) {
            if (mode.mode == Mode::kTreelet) continue;  // for larger scenes: packet_large
            contenders_.push_back(our_contender(scene_, mode));
        }
        contenders_.push_back(calling_contender(scene_));
        add_embree(EmbreeQuality::kMedium, "medium", test);
        add_embree(EmbreeQuality::kHigh, "high", test);
    }
    Arena(const Arena&) = delete;  // the contenders refer to the scene

    void hold(const Contest& contest, tools::RayKind kind, const tools::CameraOptions& camera) {
        const RaySet set = make_ray_set(kind, scene_, {camera, scene_.bounds()});
        report_.rows.push_back({set.name, set.query, set.rays.size(), contest,
                                bench::hold(contest, mesh(), set, contenders_)});
    }

    [[nodiscard]] const Report& report() const { return report_; }
    [[nodiscard]] std::span<const Contender> contenders() const { return contenders_; }

private:
    void add_embree(EmbreeQuality quality, std::string_view name, EmbreeTest test) {
        const EmbreeScene scene(mesh(), quality, test);
        report_.builds.push_back({name, scene.build().seconds, scene.build().bytes});
        for (const EmbreeModeName& mode : embree_modes()) {
            contenders_.push_back(embree_contender(scene, mode, name));
        }
    }
    [[nodiscard]] MeshView mesh() const { return scene_.meshes()[0].view(); }

    Scene scene_;
    std::vector<Contender> contenders_;
    Report report_;
};

/// Returns whether all saw the same.
bool run(const Options& options) {
    const EmbreeTest test = options.robust ? EmbreeTest::kRobust : EmbreeTest::kFast;
    nlohmann::json all = nlohmann::json::array();
    bool acceptable = true;
    for (const std::filesystem::path& path : options.scenes) {
        Arena arena(path, options.build, test);
        if (!options.json) print_head(arena.report(), arena.contenders());
        for (const int threads : options.threads) {
            for (const std::string& name : options.rays) {
                const auto& kind = tools::find_name("kind of rays", name, tools::kRayKinds);
                arena.hold({threads, options.repeats}, kind.value, options.camera);
                const Row& row = arena.report().rows.back();
                if (!options.json) print_row(row);
                acceptable &= row.acceptable();
            }
        }
        if (options.json) all.push_back(to_json(arena.report()));
    }
    if (options.json) fmt::print("{}\n", all.dump(2));
    return acceptable;
}

void add_options(CLI::App& app, Options& options) {
    app.add_option("SCENE", options.scenes, ".gltf or .glb files")->required();
    app.add_option("--threads", options.threads, "threads to trace with, as in 1,2")
        ->delimiter(',')
        ->check(CLI::Range(1, 1024))
        ->capture_default_str();
    app.add_option("--rays", options.rays, "kinds of rays, as in primary,ao")
        ->delimiter(',')
        ->check(CLI::IsMember(all_ray_kinds()))
        ->capture_default_str();
    tools::add_name_option(
        app, "--quality", "of our tree", tools::list_names(quality_names()),
        [&](std::string_view name) { options.build.quality = parse_quality(name); })
        ->default_str("balanced");
    app.add_option("--repeat", options.repeats, "timed runs of each contender")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    app.add_flag("--robust", options.robust, "Embree with its robust triangle test");
    app.add_flag("--json", options.json, "all numbers, as JSON");
    options.camera.size = {640, 480};
    tools::add_camera_options(app, options.camera);
}

}  // namespace
}  // namespace packet::bench

// Adding options throws only if they contradict each other, which every run would show.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
    packet::bench::Options options;
    CLI::App app("Traces scenes with our kernels and with Embree, on the same rays",
                 "packet_bench");
    packet::bench::add_options(app, options);
    return packet::bench::run_program(app, argc, argv,
                                      [&] { return packet::bench::run(options) ? 0 : 1; });
}
