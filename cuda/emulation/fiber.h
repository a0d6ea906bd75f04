// A stack and a place to go on at: what a CUDA thread is here. Switching swaps the registers that
// calls keep, a few nanoseconds, since a warp does it 32 times at each vote.
#pragma once

#include <cstddef>
#include <memory>

namespace packet::emulation {

/// Runs a function on a stack of its own. resume() and suspend() go back and forth between it and
/// whoever resumed it. One that is not run to its end leaves what its function owns unreleased.
class Fiber {
public:
    Fiber();
    ~Fiber();
    Fiber(const Fiber&) = delete;
    Fiber& operator=(const Fiber&) = delete;

    /// The next resume() calls function(argument), which must end by finish().
    void start(void (*function)(void*), void* argument);
    void resume();
    void suspend();
    /// As suspend(), for good.
    [[noreturn]] void finish();

private:
    static void enter(Fiber* self);
    void arrive_inside();

    // Frames of kernels are some kilobytes, ten times that under the address sanitizer.
    static constexpr std::size_t kStackBytes = 128 * 1024;

    std::unique_ptr<std::byte[]> stack_;
    void* inside_ = nullptr;   ///< stack pointer while suspended
    void* outside_ = nullptr;  ///< that of who resumed it, while running
    void (*function_)(void*) = nullptr;
    void* argument_ = nullptr;
    // What the address sanitizer wants to know of the stacks that are left.
    void* fake_inside_ = nullptr;
    void* fake_outside_ = nullptr;
    const void* outer_stack_ = nullptr;
    std::size_t outer_bytes_ = 0;
};

}  // namespace packet::emulation
