// Scenes from those that fit into the cache to those far beyond it: how fast incoherent rays are
// traced one by one, by streams, by treelets and by Embree. Prints comma-separated values, of which
// plot_large_scenes.py makes a picture and tables.
#include "contest.h"
#include "program.h"

#include <fmt/core.h>

#include <generate.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace packet::bench {
namespace {

constexpr Mode kModes[] = {Mode::kSingle, Mode::kStream, Mode::kTreelet, Mode::kAuto};

struct Options {
    std::vector<std::string> scenes = {"terrain", "city", "hairball"};
    std::vector<std::size_t> triangles = {100'000,   300'000,    1'000'000,
                                          3'000'000, 10'000'000, 20'000'000};
    std::vector<std::string> rays = {"random", "diffuse"};
    std::vector<int> threads = {1, 2};
    int side = 2048;  ///< of the image that has as many pixels as there are rays
    Contest contest;
};

/// Each of ours; of Embree every way to call it that suits incoherent rays, on the tree that it
/// builds by default; that of high quality splits triangles, and takes too much memory to build.
std::vector<Contender> all_contenders(const Scene& scene, const EmbreeScene& embree) {
    std::vector<Contender> out;
    for (const Mode mode : kModes) out.push_back(our_contender(scene, {mode, to_string(mode)}));
    for (const EmbreeModeName& mode : embree_modes()) {
        if (mode.name.ends_with('c')) continue;  // for coherent rays
        out.push_back(embree_contender(embree, mode, "medium"));
    }
    return out;
}

void print_scores(std::string_view scene, std::size_t triangles, std::size_t bytes,
                  const RaySet& set, int threads, std::span<const Score> scores) {
    double embree = std::numeric_limits<double>::infinity();
    const auto print = [&](std::string_view name, double seconds) {
        fmt::print("{},{},{},{},{},{},{:.4f}\n", scene, triangles, bytes, set.name, threads, name,
                   1e-6 * static_cast<double>(set.rays.size()) / seconds);
        std::fflush(stdout);
    };
    for (const Score& score : scores) {
        if (score.contender->side == Side::kEmbree) {
            embree = std::min(embree, score.median_seconds());
        } else {
            print(score.contender->name, score.median_seconds());
        }
    }
    print("Embree", embree);
}

/// Whether all of ours answered alike.
bool measure(std::string_view kind, std::size_t triangles, const Options& options) {
    Scene scene = make_scene(tools::generate(kind, triangles));
    BuildOptions build;
    build.treelet_bytes = kUsualTreeletBytes;
    scene.commit(build);
    const TriangleMesh& mesh = scene.meshes()[0];
    const EmbreeScene embree(mesh.view());
    const std::vector<Contender> contenders = all_contenders(scene, embree);
    tools::CameraOptions view;
    view.size = {options.side, options.side};
    bool alike = true;
    for (const std::string& name : options.rays) {
        const auto which = tools::find_name("rays", name, tools::kRayKinds).value;
        const RaySet set = make_ray_set(which, scene, tools::Camera(view, scene.bounds()));
        for (const int threads : options.threads) {
            Contest contest = options.contest;
            contest.threads = threads;
            const std::vector<Score> scores = hold(contest, mesh.view(), set, contenders);
            print_scores(kind, scene.triangle_count(), scene.build_stats().bytes, set, threads,
                         scores);
            for (const Score& score : scores) {
                alike &= score.contender->side == Side::kEmbree || score.agreement.different == 0;
            }
        }
    }
    return alike;
}

int run(const Options& options) {
    bool alike = true;
    fmt::print("scene,triangles,bytes,rays,threads,mode,mrays_per_s\n");
    for (const std::string& kind : options.scenes) {
        for (const std::size_t triangles : options.triangles) {
            alike &= measure(kind, triangles, options);
        }
    }
    if (!alike) fmt::print(stderr, "packet_large: our modes differ in their hits\n");
    return alike ? 0 : 1;
}

}  // namespace
}  // namespace packet::bench

// Adding options throws only if they contradict each other, which every run would show.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
    packet::bench::Options options;
    options.contest.repeats = 3;
    CLI::App app("Traces incoherent rays in scenes of growing size", "packet_large");
    app.add_option("--scenes", options.scenes, "kinds of generated scenes")->delimiter(',');
    app.add_option("--triangles", options.triangles, "of each scene")
        ->delimiter(',')
        ->check(CLI::Range(std::size_t{1}, packet::tools::kMaxTriangles));
    app.add_option("--rays", options.rays, "kinds of rays, as in random,ao")->delimiter(',');
    app.add_option("--threads", options.threads)->delimiter(',')->check(CLI::Range(1, 4096));
    app.add_option("--side", options.side, "its square is the number of rays")
        ->check(CLI::Range(1, 10000))
        ->capture_default_str();
    app.add_option("--repeat", options.contest.repeats, "timed runs of each")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    return packet::bench::run_program(app, argc, argv, [&] { return packet::bench::run(options); });
}
