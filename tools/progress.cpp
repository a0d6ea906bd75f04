// A progress bar on the terminal.
#include "progress.h"

#include <fmt/format.h>

#include <unistd.h>
#include <algorithm>
#include <cstdio>

namespace packet::tools {
namespace {

constexpr std::size_t kBarWidth = 40;
constexpr std::chrono::milliseconds kInterval{100};  // smooth to the eye, free to the job

}  // namespace

Progress::Progress(std::string_view job, std::size_t total)
    : job_(job), total_(std::max<std::size_t>(total, 1)), visible_(::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
    if (visible_) std::fputs("\r\x1b[K", stderr);  // to the line's start, erase the line
}

void Progress::advance(std::size_t steps) {
    if (!visible_) return;
    const std::size_t done = std::min(done_ += steps, total_);
    // A thread that finds another one drawing goes on working.
    const std::unique_lock lock(drawing_, std::try_to_lock);
    const auto now = std::chrono::steady_clock::now();
    if (!lock || now - last_drawn_ < kInterval) return;
    last_drawn_ = now;
    const double fraction = static_cast<double>(done) / static_cast<double>(total_);
    const auto filled = static_cast<std::size_t>(fraction * kBarWidth);
    fmt::print(stderr, "\r{} [{:#<{}}{:.<{}}] {:3.0f}%", job_, "", filled, "", kBarWidth - filled,
               100.0 * fraction);
}

void commit_visibly(Scene& scene, BuildOptions options) {
    constexpr std::size_t kSteps = 1000;
    Progress progress("build", kSteps);
    std::size_t shown = 0;
    if (progress.is_visible()) {
        options.progress = [&](float fraction) {
            const auto step = static_cast<std::size_t>(fraction * float{kSteps});
            progress.advance(step - shown);
            shown = step;
            return true;
        };
    }
    scene.commit(options);
}

}  // namespace packet::tools
