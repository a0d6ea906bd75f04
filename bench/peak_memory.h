// What memory a piece of work needs at most.
#pragma once

#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <string>

namespace packet::bench {

/// Bytes of the process that are in memory by a line of /proc/self/status: "VmRSS" now, "VmHWM" at
/// most. 0 where the system tells no such thing.
[[nodiscard]] inline std::size_t resident_bytes(const std::string& name) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.rfind(name + ":", 0) == 0) {
            return std::strtoull(line.c_str() + name.size() + 1, nullptr, 10) * 1024;
        }
    }
    return 0;
}

/// By how many bytes what the process holds in memory grows at most during `work`. This is done in
/// a child, which has given back what was freed before. Call it before the process starts
/// threads, which the child does not have. Throws std::runtime_error if that fails.
[[nodiscard]] inline std::size_t peak_bytes_of(const std::function<void()>& work) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) throw std::runtime_error("cannot make a pipe");
    const pid_t child = fork();
    if (child < 0) throw std::runtime_error("cannot start a process");
    if (child == 0) {
        malloc_trim(0);  // else what loading a scene has freed would serve the work
        const std::size_t before = resident_bytes("VmRSS");
        std::ofstream("/proc/self/clear_refs") << "5";  // the peak starts anew
        work();
        const std::size_t grown = resident_bytes("VmHWM") - before;
        _exit(write(ends[1], &grown, sizeof(grown)) == sizeof(grown) ? 0 : 1);
    }
    close(ends[1]);
    std::size_t grown = 0;
    const bool is_told = read(ends[0], &grown, sizeof(grown)) == sizeof(grown);
    close(ends[0]);
    int status = 0;
    if (waitpid(child, &status, 0) != child || status != 0 || !is_told) {
        throw std::runtime_error("a build in a process of its own failed");
    }
    return grown;
}

}  // namespace packet::bench
