// The device that tests of CUDA run on: the machine's, or one that is emulated on the CPU.
#pragma once

#include <packet/cuda.h>
#include <packet/error.h>
#include <packet/scene.h>

#if defined(PACKET_EMULATED)
#include "emulation/grid.h"
#endif

#include <iostream>

namespace packet::test {

/// Whether to go on; else says that the test was skipped. ctest takes the line for that.
[[nodiscard]] inline bool has_device() {
    try {
        (void)cuda::device_name();
        return true;
    } catch (const Error& error) {
        std::cout << "skipped: " << error.what() << "\n";
        return false;
    }
}

/// With what devices walk.
inline void commit_for_devices(Scene& scene) {
    BuildOptions options;
    options.keep_binary_nodes = true;
    scene.commit(options);
}

// Orders in which threads run: those that the emulation has, or the one that a device chooses.
#if defined(PACKET_EMULATED)
inline constexpr int kThreadOrders = 3;
inline void set_thread_order(int order) {
    emulation::set_order(static_cast<emulation::Order>(order), 11);
}
#else
inline constexpr int kThreadOrders = 1;
inline void set_thread_order(int) {}
#endif

}  // namespace packet::test
