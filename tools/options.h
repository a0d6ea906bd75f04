// Options that several commands share.
#pragma once

#include "camera.h"
#include "names.h"

#include <packet/accel.h>
#include <packet/trace.h>

#include <CLI/CLI.hpp>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace packet::tools {

/// What traces.
enum class Device : std::uint8_t { kCpu, kCuda };
inline constexpr Named<Device> kDevices[] = {{Device::kCpu, "cpu"}, {Device::kCuda, "cuda"}};

struct CommonOptions {
    BuildOptions build;
    TraceOptions trace;
};

/// With what the device walks.
[[nodiscard]] inline BuildOptions build_options_for(Device device, BuildOptions options) {
    options.keep_binary_nodes = device == Device::kCuda;
    return options;
}

/// Adds an option whose value is a name. `help` is followed by the list of `names`. `take` throws
/// an Error if it does not know the name it is given.
CLI::Option* add_name_option(CLI::App& app, const std::string& flags, const std::string& help,
                             const std::string& names, std::function<void(std::string_view)> take);

// What these add writes into the second argument, which must outlive the parse.
void add_common_options(CLI::App& app, CommonOptions& options);
void add_treelet_options(CLI::App& app, CommonOptions& options);
void add_camera_options(CLI::App& app, CameraOptions& options);
void add_device_option(CLI::App& app, Named<Device>& device);

}  // namespace packet::tools
