// Options that several commands share.
#include "options.h"

#include "image.h"
#include "usage_error.h"

#include <packet/isa.h>

#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

namespace packet::tools {
namespace {

constexpr Named<TreeletCut> kTreeletCuts[] = {{TreeletCut::kAreas, "areas"},
                                              {TreeletCut::kSubtrees, "subtrees"}};

/// Modes that never use treelets are not to wait for trees to be cut.
std::optional<std::size_t> treelet_bytes_for(Mode mode) {
    if (mode == Mode::kTreelet) return kUsualTreeletBytes;
    if (mode == Mode::kAuto) return std::nullopt;
    return 0;
}

/// All of the text as a number, in the same way whatever the locale.
template <class T>
std::optional<T> parse_number(std::string_view text) {
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
    std::vector<std::string_view> parts;
    for (std::size_t end; (end = text.find(separator)) != std::string_view::npos;) {
        parts.push_back(text.substr(0, end));
        text.remove_prefix(end + 1);
    }
    parts.push_back(text);
    return parts;
}

glm::vec3 parse_vector(std::string_view flag, const std::string& text) {
    const std::vector<std::string_view> parts = split(text, ',');
    glm::vec3 vector(0.0f);
    bool valid = parts.size() == 3;
    for (int axis = 0; valid && axis < 3; ++axis) {
        const auto number = parse_number<float>(parts[static_cast<std::size_t>(axis)]);
        valid = number && std::isfinite(*number);
        vector[axis] = number.value_or(0.0f);
    }
    if (!valid) throw UsageError(fmt::format("{} takes X,Y,Z, not '{}'", flag, text));
    return vector;
}

ImageSize parse_size(const std::string& text) {
    const std::vector<std::string_view> parts = split(text, 'x');
    const auto width = parse_number<int>(parts.front()), height = parse_number<int>(parts.back());
    const auto valid = [](const std::optional<int>& side) {
        return side && *side >= 1 && *side <= kMaxImageSide;
    };
    if (parts.size() != 2 || !valid(width) || !valid(height)) {
        throw UsageError(fmt::format("--size takes WIDTHxHEIGHT, each from 1 to {}, not '{}'",
                                     kMaxImageSide, text));
    }
    return {*width, *height};
}

float parse_fov(const std::string& text) {
    const auto degrees = parse_number<float>(text);
    const bool valid = degrees && *degrees > 0.0f && *degrees < 180.0f;  // false for NaN
    if (!valid) throw UsageError("--fov takes degrees above 0 and below 180, not '" + text + "'");
    return *degrees;
}

std::string isa_names() {
    std::vector<std::string_view> names;
    for (const IsaId isa : built_isas()) names.push_back(to_string(isa));
    return fmt::format("{}", fmt::join(names, ", "));
}

/// The instruction set of that name, if this CPU runs it.
IsaId usable_isa(std::string_view name) {
    const IsaId wanted = parse_isa(name);
    if (cpu_supports(wanted)) return wanted;
    std::vector<std::string_view> supported;
    for (const IsaId isa : built_isas()) {
        if (cpu_supports(isa)) supported.push_back(to_string(isa));
    }
    throw Error(ErrorCode::kUnsupported, fmt::format("this CPU does not run {}; it runs: {}", name,
                                                     fmt::join(supported, ", ")));
}

}  // namespace

CLI::Option* add_name_option(CLI::App& app, const std::string& flags, const std::string& help,
                             const std::string& names, std::function<void(std::string_view)> take) {
    const auto call = [take = std::move(take)](const std::string& name) { take(name); };
    return app.add_option_function<std::string>(flags, call, help + ": " + names)
        ->type_name("NAME");
}

void add_common_options(CLI::App& app, CommonOptions& options) {
    add_name_option(app, "--accel", "Acceleration structure", list_names(accel_names()),
                    [&](std::string_view name) { options.build.accel = parse_accel(name); })
        ->default_str("bvh");
    add_name_option(app, "--kd-build", "Of kd-sah", list_names(kd_build_names()),
                    [&](std::string_view name) { options.build.kd_build = parse_kd_build(name); })
        ->default_str("breadth-first");
    add_name_option(app, "--quality", "Of the bvh, which chooses its builder",
                    list_names(quality_names()),
                    [&](std::string_view name) { options.build.quality = parse_quality(name); })
        ->default_str("balanced");
    // Before any work is done, and whichever of the two came first.
    app.parse_complete_callback([&] { (void)chosen_accel(options.build); });
    add_name_option(app, "--mode", "How rays are grouped", list_names(mode_names()),
                    [&](std::string_view name) {
                        options.trace.mode = parse_mode(name);
                        // --treelet-bytes is defined after this and so has the last word.
                        options.build.treelet_bytes = treelet_bytes_for(options.trace.mode);
                    })
        ->default_str("auto");
    add_name_option(app, "--isa", "Instruction set, without it the CPU's best", isa_names(),
                    [&](std::string_view name) { options.trace.isa = usable_isa(name); });
    app.add_option_function<int>(
           "--threads",
           [&](int threads) { options.build.threads = options.trace.threads = threads; },
           "Threads to build and trace with, 0 for all")
        ->check(CLI::Range(0, 4096))
        ->default_str("0");
}

void add_treelet_options(CLI::App& app, CommonOptions& options) {
    add_name_option(app, "--treelet-cut", "How trees are cut for treelet", list_names(kTreeletCuts),
                    [&](std::string_view name) {
                        options.build.treelet_cut =
                            find_name("treelet cut", name, kTreeletCuts).value;
                    })
        ->default_str(std::string(kTreeletCuts[0].name));
    app.add_option("--treelet-bytes", options.build.treelet_bytes,
                   "Bytes of a treelet, at most; 0 for none")
        ->default_str(fmt::format("{} with --mode treelet, or auto if the tree is large",
                                  kUsualTreeletBytes));
    app.add_option("--queue-bytes", options.trace.queue_bytes, "Bytes for rays that wait")
        ->capture_default_str();
    app.add_option("--queue-chunk", options.trace.queue_chunk, "Rays by which queues grow")
        ->check(CLI::Range(1, 65536))
        ->capture_default_str();
}

void add_device_option(CLI::App& app, Named<Device>& device) {
    add_name_option(app, "--device", "What traces", list_names(kDevices),
                    [&](std::string_view name) { device = find_name("device", name, kDevices); })
        ->default_str("cpu");
}

void add_camera_options(CLI::App& app, CameraOptions& options) {
    const auto add = [&](const char* flag, const char* help, auto take) {
        return app.add_option_function<std::string>(flag, take, help);
    };
    add("--size", "Image size in pixels",
        [&](const std::string& text) { options.size = parse_size(text); })
        ->type_name("WxH")
        ->default_str(fmt::format("{}x{}", options.size.width, options.size.height));
    add("--eye", "Where the camera is; without it, where all of the scene is seen",
        [&](const std::string& text) { options.eye = parse_vector("--eye", text); })
        ->type_name("X,Y,Z");
    add("--at", "What the camera looks at; without it, the middle of the scene",
        [&](const std::string& text) { options.at = parse_vector("--at", text); })
        ->type_name("X,Y,Z");
    add("--up", "What is upward in the image",
        [&](const std::string& text) { options.up = parse_vector("--up", text); })
        ->type_name("X,Y,Z")
        ->default_str("0,1,0");
    add("--fov", "Vertical angle of view in degrees",
        [&](const std::string& text) { options.fov_degrees = parse_fov(text); })
        ->type_name("DEG")
        ->default_str(fmt::format("{}", options.fov_degrees));
}

}  // namespace packet::tools
