// Runs a grid of CUDA threads on one CPU thread: each is a fiber, and each *_sync is a rendezvous
// of exactly the lanes in its mask. What a GPU leaves undefined is an EmulationError here, which
// names block, thread and lane: lanes that never meet, a mask that leaves out its caller or names a
// lane that has left, shared memory out of bounds, never written, or read and written without a
// barrier in between.
//
// Votes and shuffles order no memory, as CUDA says: only __syncwarp and __syncthreads do.
//
// The checks of memory are of shared memory. Global memory is the CPU's, for sanitizers to check;
// what other threads see of it without __threadfence, no emulation on one CPU thread can tell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace packet::emulation {

/// What a kernel has done wrong.
class EmulationError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// In which order threads that could run do: what a right kernel yields does not depend on it.
enum class Order : std::uint8_t { kForward, kReverse, kRandom };

/// For all launches from now on. `seed` is for kRandom.
void set_order(Order order, std::uint64_t seed = 0);

struct Shape {
    unsigned blocks = 1, threads = 1;
    std::size_t shared_bytes = 0;
};

/// Runs the kernel in all threads of the grid. Throws EmulationError.
void run_grid(const Shape& shape, const std::function<void()>& kernel);

// ---- What the running thread may ask for. Fails the launch if there is none. ----

enum class Operation : std::uint8_t { kBallot, kAny, kAll, kShuffle, kSyncWarp, kSyncThreads };

/// Meets the lanes of `mask`, which ask for the same operation. kBallot, kAny, kAll: `value` is the
/// lane's vote. kShuffle: yields the value of lane `source`.
std::uint64_t meet(Operation operation, std::uint32_t mask, std::uint64_t value = 0,
                   unsigned source = 0);
void sync_threads();
/// Lets others run, as they might between any two instructions.
void yield();

/// A word of the block's dynamic shared memory.
std::uint32_t read_shared(std::size_t word);
void write_shared(std::size_t word, std::uint32_t value);
/// Makes it combine(what it was, value), at once.
void change_shared(std::size_t word, std::uint32_t (*combine)(std::uint32_t, std::uint32_t),
                   std::uint32_t value);
/// Ends the launch: the thread used index `index` of an array of `count`.
[[noreturn]] void fail_bounds(const char* what, std::size_t index, std::size_t count);

}  // namespace packet::emulation
