// packet make: generated scenes.
#include "commands.h"
#include "generate.h"
#include "options.h"
#include "write_glb.h"

#include <fmt/format.h>

#include <memory>
#include <string>

namespace packet::tools {
namespace {

struct MakeOptions {
    std::string output;
    const SceneKind* kind = nullptr;
    std::size_t triangles = 100'000;
    std::uint64_t seed = 1;
};

void run(const MakeOptions& options) {
    OutputFile file(options.output);  // first, so that a bad name is told before the work is done
    const TriangleMesh mesh = options.kind->make(options.triangles, options.seed);
    write_glb(std::move(file), mesh);
    print(fmt::format("{}: {} triangles\n", options.output, mesh.triangles.size()));
}

}  // namespace

void add_make_command(CLI::App& program) {
    CLI::App& app = *program.add_subcommand("make", "Generate a scene");
    const auto options = std::make_shared<MakeOptions>();
    add_name_option(app, "kind", "What scene", list_names(kSceneKinds),
                    [options = options.get()](std::string_view name) {
                        options->kind = &find_name("kind of scene", name, kSceneKinds);
                    })
        ->required();
    app.add_option("-o,--output", options->output, "The scene")->required()->type_name("SCENE.glb");
    app.add_option("--triangles", options->triangles, "As many as the kind can have, up to this")
        ->check(CLI::Range(std::size_t{1}, kMaxTriangles))
        ->capture_default_str();
    app.add_option("--seed", options->seed, "Another scene of the kind")->capture_default_str();
    app.callback([options] { run(*options); });
}

}  // namespace packet::tools
