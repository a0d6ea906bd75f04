// packet info: what is in a scene.
#include "commands.h"

#include <packet/gltf.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <memory>
#include <string>

namespace packet::tools {
namespace {

struct InfoOptions {
    std::string scene;
    bool json = false;
};

std::string to_json(const GltfScene& loaded) {
    const Scene& scene = loaded.scene;
    const Bounds3f bounds = scene.bounds();
    const SkippedTriangles skipped = scene.skipped();
    using nlohmann::ordered_json;
    // Infinities, as of an empty scene's bounds, become null.
    const auto list = [](const glm::vec3& v) { return ordered_json::array({v.x, v.y, v.z}); };
    ordered_json json;
    json["scene"] = {{"triangles", scene.triangle_count()},
                     {"meshes", scene.meshes().size()},
                     {"instances", scene.instances().size()}};
    json["bounds"] = {{"lower", list(bounds.lower)}, {"upper", list(bounds.upper)}};
    json["skipped"] = {{"non_finite", skipped.non_finite},
                       {"too_large", skipped.too_large},
                       {"zero_area", skipped.zero_area},
                       {"non_triangle_primitives", loaded.skipped_primitives}};
    return json.dump() + "\n";
}

std::string to_text(const GltfScene& loaded) {
    const Scene& scene = loaded.scene;
    const Bounds3f bounds = scene.bounds();
    const SkippedTriangles skipped = scene.skipped();
    std::string text =
        fmt::format("triangles  {}\nmeshes     {}\ninstances  {}\n", scene.triangle_count(),
                    scene.meshes().size(), scene.instances().size());
    if (!bounds.empty()) {
        const auto& [lower, upper] = bounds;
        text += fmt::format("bounds     ({}, {}, {}) to ({}, {}, {})\n", lower.x, lower.y, lower.z,
                            upper.x, upper.y, upper.z);
    }
    text += fmt::format(
        "skipped    {} triangles (non-finite {}, too large {}, zero area {}), "
        "{} primitives of points or lines\n",
        skipped.total(), skipped.non_finite, skipped.too_large, skipped.zero_area,
        loaded.skipped_primitives);
    return text;
}

void run(const InfoOptions& options) {
    const GltfScene loaded = load_gltf(options.scene);
    print(options.json ? to_json(loaded) : to_text(loaded));
}

}  // namespace

void add_info_command(CLI::App& program) {
    CLI::App& app = *program.add_subcommand("info", "Describe a scene");
    const auto options = std::make_shared<InfoOptions>();
    app.add_option("scene", options->scene, "The scene, .gltf or .glb")
        ->required()
        ->type_name("SCENE");
    app.add_flag("--json", options->json, "Print one JSON object");
    app.callback([options] { run(*options); });
}

}  // namespace packet::tools
