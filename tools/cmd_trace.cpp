// packet trace: traces rays from a file, writes their hits and reports the speed.
#include "commands.h"
#include "cuda_tracer.h"
#include "npy.h"
#include "options.h"
#include "progress.h"
#include "timing.h"
#include "trace_report.h"

#include <packet/gltf.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace packet::tools {
namespace {

enum class Query : std::uint8_t { kClosest, kAny };
constexpr Named<Query> kQueries[] = {{Query::kClosest, "closest"}, {Query::kAny, "any"}};

struct TraceCommand {
    std::string scene, rays, output;
    Named<Query> query = kQueries[0];
    int repeats = 1;
    bool flatten = false, stats = false, json = false;
    CommonOptions common;
    Named<Device> device = kDevices[0];
};

/// What the rays met, in the form that the query asks for; the other is empty.
struct Answer {
    std::vector<Hit> hits;
    std::vector<std::uint8_t> occluded;

    Answer(Query query, std::size_t count)
        : hits(query == Query::kClosest ? count : 0), occluded(query == Query::kAny ? count : 0) {}

    [[nodiscard]] std::size_t hit_count() const {
        const auto is_hit = [](const Hit& hit) { return hit.is_hit(); };
        return static_cast<std::size_t>(
            std::count_if(hits.begin(), hits.end(), is_hit) +
            std::count(occluded.begin(), occluded.end(), std::uint8_t{1}));
    }
};

/// What the command names, with the scene in its memory.
class Contender {
public:
    Contender(const Scene& scene, const TraceCommand& command)
        : scene_(scene), options_(command.common.trace), query_(command.query.value) {
        if (command.device.value == Device::kCuda) device_.emplace(scene);
    }

    void trace(std::span<const Ray> rays, Answer& answer, TraceStats* stats = nullptr) const {
        if (device_) {
            trace_on(*device_, rays, answer, {device_mode(options_.mode), options_.width, stats});
            return;
        }
        TraceOptions options = options_;
        options.stats = stats;
        if (query_ == Query::kAny) {
            trace_any(scene_, rays, answer.occluded, options);
        } else {
            trace_closest(scene_, rays, answer.hits, options);
        }
    }

private:
    void trace_on(const cuda::DeviceScene& device, std::span<const Ray> rays, Answer& answer,
                  const cuda::DeviceTraceOptions& options) const {
        if (query_ == Query::kAny) {
            device.trace_any(rays, answer.occluded, options);
        } else {
            device.trace_closest(rays, answer.hits, options);
        }
    }

    const Scene& scene_;
    TraceOptions options_;
    Query query_;
    std::optional<cuda::DeviceScene> device_;
};

/// The median time of tracing, from rays in memory to hits in memory.
double measure(const Contender& contender, std::span<const Ray> rays, const TraceCommand& command,
               Answer& answer) {
    std::vector<double> seconds;
    Progress progress("trace", static_cast<std::size_t>(command.repeats));
    for (int repeat = 0; repeat < command.repeats; ++repeat) {
        seconds.push_back(seconds_of([&] { contender.trace(rays, answer); }));
        progress.advance(1);
    }
    return median(std::move(seconds));
}

/// Counts the work in a run of its own, as counting takes time.
TraceStats count_work(const Contender& contender, std::span<const Ray> rays, Answer& answer) {
    TraceStats stats;
    contender.trace(rays, answer, &stats);
    return stats;
}

TraceReport describe(const Scene& scene, const TraceCommand& command) {
    const CommonOptions& common = command.common;
    TraceReport report;
    report.triangles = scene.triangle_count();
    report.instances = scene.instances().size();
    report.accel = chosen_accel(common.build);
    report.mode = common.trace.mode;
    report.device = command.device.name;
    report.isa = common.trace.isa ? *common.trace.isa : default_isa();
    const int all = static_cast<int>(std::max(std::thread::hardware_concurrency(), 1u));
    report.threads = common.trace.threads == 0 ? all : std::min(common.trace.threads, all);
    report.query = command.query.name;
    report.build = scene.build_stats();
    report.repeats = command.repeats;
    return report;
}

void write(OutputFile file, const TraceCommand& command, const Answer& answer) {
    if (command.query.value == Query::kAny) {
        write_occluded(std::move(file), answer.occluded);
    } else {
        write_hits(std::move(file), answer.hits);
    }
}

void run(const TraceCommand& command) {
    if (command.device.value == Device::kCuda)
        (void)cuda::device_name();   // throws if there is none
    std::optional<OutputFile> file;  // first, so that a bad name is told before the work is done
    if (!command.output.empty()) file.emplace(command.output);
    const std::vector<Ray> rays = read_rays(command.rays);
    Scene scene = load_gltf(command.scene).scene;
    if (command.flatten) scene = make_scene(scene.flatten());
    commit_visibly(scene, build_options_for(command.device.value, command.common.build));

    Answer answer(command.query.value, rays.size());
    TraceReport report = describe(scene, command);
    const Contender contender(scene, command);
    report.seconds = measure(contender, rays, command, answer);
    if (command.stats) report.stats = count_work(contender, rays, answer);
    report.rays = rays.size();
    report.hits = answer.hit_count();
    if (file) write(std::move(*file), command, answer);
    print(command.json ? to_json(report) : to_text(report));
}

}  // namespace

void add_trace_command(CLI::App& program) {
    CLI::App& app = *program.add_subcommand("trace", "Trace rays and report the speed");
    const auto command = std::make_shared<TraceCommand>();
    app.add_option("scene", command->scene, "The scene, .gltf or .glb")
        ->required()
        ->type_name("SCENE");
    app.add_option("rays", command->rays, "float32 of shape (n, 8): org, tnear, dir, tfar")
        ->required()
        ->type_name("RAYS.npy");
    app.add_option("-o,--output", command->output, "Where the hits go, in the rays' order")
        ->type_name("HITS.npy");
    add_name_option(app, "--query", "Nearest hit or whether there is any", list_names(kQueries),
                    [command = command.get()](std::string_view name) {
                        command->query = find_name("query", name, kQueries);
                    })
        ->default_str("closest");
    constexpr int kUnbounded = std::numeric_limits<int>::max();
    app.add_option("--repeat", command->repeats, "Trace so often and report the median time")
        ->check(CLI::Range(1, 1'000'000))
        ->capture_default_str();
    app.add_option("--width", command->common.trace.width,
                   "The rays are an image's, so many to a line; 0 if that is not known")
        ->check(CLI::Range(0, kUnbounded))
        ->capture_default_str();
    app.add_flag("--flatten", command->flatten, "Bake all instances into one mesh first");
    app.add_flag("--stats", command->stats, "Count nodes and triangles in a run of its own");
    app.add_flag("--json", command->json, "Print one JSON object");
    add_common_options(app, command->common);
    add_treelet_options(app, command->common);
    add_device_option(app, command->device);
    app.callback([command] { run(*command); });
}

}  // namespace packet::tools
