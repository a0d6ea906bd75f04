// packet_builds: how fast our quickest builders are beside Embree's, over scenes or a million
// generated triangles, as a table in Markdown. docs/benchmarking.md shows what it prints.
#include "embree_reference.h"
#include "markdown.h"
#include "peak_memory.h"
#include "program.h"

#include <packet/accel.h>
#include <packet/gltf.h>
#include <packet/scene.h>

#include <fmt/core.h>

#include <generate.h>
#include <timing.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace packet::bench {
namespace {

struct Options {
    std::vector<std::filesystem::path> scenes;
    std::size_t triangles = 1'000'000;
    int repeats = 5;
};

/// What a build came to. Embree does not tell the cost of its trees: it is 0 then.
struct Built {
    double seconds;
    std::size_t bytes;
    double sah_cost;
};

enum class Rival { kNone, kNext };

struct Builder {
    std::string name;
    std::function<Built(const Scene&)> build;
    Rival rival;  ///< whom it is compared with: the next one, which spends about as much on a tree
};
using Builders = std::array<Builder, 7>;
using Peaks = std::array<std::size_t, 7>;

[[nodiscard]] std::size_t bytes_of_arrays(const TriangleMesh& mesh) {
    return mesh.positions.size() * sizeof(mesh.positions[0]) +
           mesh.triangles.size() * sizeof(mesh.triangles[0]);
}

Builder our_builder(AccelKind accel, Rival rival) {
    const auto build = [accel](const Scene& scene) {
        Scene copy = scene;
        BuildOptions options;
        options.accel = accel;
        const double seconds = tools::seconds_of([&] { copy.commit(options); });
        return Built{seconds, copy.build_stats().bytes, copy.build_stats().sah_cost};
    };
    return {std::string(to_string(accel)), build, rival};
}

Builder embree_builder(EmbreeQuality quality, std::string_view name) {
    const auto build = [quality](const Scene& scene) {
        const EmbreeBuild built = EmbreeScene(scene.meshes()[0].view(), quality).build();
        return Built{built.seconds, built.bytes, 0.0};
    };
    return {fmt::format("{} {}", embree_version(), name), build, Rival::kNone};
}

Builders all_builders() {
    return {our_builder(AccelKind::kBvhMorton, Rival::kNext),
            embree_builder(EmbreeQuality::kLow, "low"),
            our_builder(AccelKind::kBvh, Rival::kNext),
            embree_builder(EmbreeQuality::kMedium, "medium"),
            our_builder(AccelKind::kBvhSpatial, Rival::kNext),
            embree_builder(EmbreeQuality::kHigh, "high"),
            our_builder(AccelKind::kGrid, Rival::kNone)};
}

/// What each builder needs at most, but for the arrays, which both sides copy.
Peaks peaks_of(const Builders& builders, const Scene& scene) {
    const std::size_t arrays = bytes_of_arrays(scene.meshes()[0]);
    Peaks out{};
    for (std::size_t i = 0; i < builders.size(); ++i) {
        const std::size_t peak = peak_bytes_of([&] { (void)builders[i].build(scene); });
        out[i] = peak - std::min(peak, arrays);
    }
    return out;
}

void hold_contest(std::string_view kind, const Scene& scene, const Builders& builders,
                  const Peaks& peaks, const Options& options) {
    const auto triangles = static_cast<double>(scene.triangle_count());
    std::array<std::vector<double>, 7> seconds;
    std::array<Built, 7> last{};
    for (int repeat = -1; repeat < options.repeats; ++repeat) {  // the first warms up
        for (std::size_t i = 0; i < builders.size(); ++i) {
            last[i] = builders[i].build(scene);
            if (repeat >= 0) seconds[i].push_back(last[i].seconds);
        }
    }
    for (std::size_t i = 0; i < builders.size(); ++i) {
        const double median = tools::median(seconds[i]);
        const bool has_rival = builders[i].rival == Rival::kNext;
        print_cells({std::string(kind), builders[i].name, three_digits(1e-6 * triangles / median),
                     has_rival ? fmt::format("{:.2f}", tools::median(seconds[i + 1]) / median) : "",
                     fmt::format("{:.0f}", static_cast<double>(last[i].bytes) / triangles),
                     fmt::format("{:.0f}", static_cast<double>(peaks[i]) / triangles),
                     last[i].sah_cost > 0.0 ? three_digits(last[i].sah_cost) : ""});
    }
}

struct NamedScene {
    std::string name;
    Scene scene;
};
std::vector<NamedScene> scenes_of(const Options& options) {
    std::vector<NamedScene> out;
    for (const std::filesystem::path& path : options.scenes)
        out.push_back({path.stem().string(), make_scene(load_gltf(path).scene.flatten())});
    if (!out.empty()) return out;
    for (const std::string_view kind : {"terrain", "city", "hairball", "soup"})
        out.push_back({std::string(kind), make_scene(tools::generate(kind, options.triangles))});
    return out;
}

void run(const Options& options) {
    const Builders builders = all_builders();
    const std::vector<NamedScene> scenes = scenes_of(options);
    std::vector<Peaks> peaks;
    peaks.reserve(scenes.size());
    // First, as these processes must be started before there are threads.
    for (const NamedScene& scene : scenes) peaks.push_back(peaks_of(builders, scene.scene));
    print_table_head({"scene", "builder", "Mtriangles/s", "Embree = 1", "bytes/triangle", "at most",
                      "SAH cost"});
    for (std::size_t i = 0; i < scenes.size(); ++i) {
        hold_contest(scenes[i].name, scenes[i].scene, builders, peaks[i], options);
    }
}

}  // namespace
}  // namespace packet::bench

// Adding options throws only if they contradict each other, which every run would show.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
    packet::bench::Options options;
    CLI::App app("Builds scenes with our builders and Embree's, on all threads", "packet_builds");
    app.add_option("SCENE", options.scenes, ".gltf or .glb files; none: generated ones");
    app.add_option("--triangles", options.triangles, "of each generated scene")
        ->check(CLI::Range(std::size_t{1}, packet::tools::kMaxTriangles))
        ->capture_default_str();
    app.add_option("--repeat", options.repeats, "timed builds of each")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    return packet::bench::run_program(app, argc, argv, [&] {
        packet::bench::run(options);
        return 0;
    });
}
