// Names of the device's modes, with or without CUDA.
#include "core/names.h"

#include <packet/cuda.h>

#include <array>

namespace packet::cuda {

static constexpr std::array kDeviceModeNames = {
    DeviceModeName{DeviceMode::kAuto, "auto"},
    DeviceModeName{DeviceMode::kWarp, "warp"},
    DeviceModeName{DeviceMode::kThread, "thread"},
    DeviceModeName{DeviceMode::kSorted, "sorted"},
};

std::span<const DeviceModeName> device_mode_names() noexcept { return kDeviceModeNames; }

std::string_view to_string(DeviceMode mode) noexcept {
    for (const DeviceModeName& entry : kDeviceModeNames) {
        if (entry.mode == mode) return entry.name;
    }
    return "?";
}

DeviceMode parse_device_mode(std::string_view name) {
    return find_by_name(kDeviceModeNames, name, "device mode").mode;
}

}  // namespace packet::cuda
