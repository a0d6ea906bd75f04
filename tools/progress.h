// A progress bar on the terminal.
#pragma once

#include <packet/scene.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>
#include <string_view>

namespace packet::tools {

/// Shows how far a long job is on stderr, if that is a terminal; else does nothing. The bar is
/// erased at the end. Safe to advance from many threads.
class Progress {
public:
    Progress(std::string_view job, std::size_t total);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void advance(std::size_t steps);
    [[nodiscard]] bool is_visible() const noexcept { return visible_; }

private:
    std::string job_;
    std::size_t total_;
    bool visible_;
    std::atomic<std::size_t> done_{0};
    std::mutex drawing_;
    std::chrono::steady_clock::time_point last_drawn_{};
};

/// Commits the scene and shows how far that is.
void commit_visibly(Scene& scene, BuildOptions options);

}  // namespace packet::tools
