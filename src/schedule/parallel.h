// Spreads loops and pairs of tasks over threads. With one thread everything runs on the caller's,
// and TBB is not touched; with more, in an arena of that many, so that no global setting is
// changed.
#pragma once

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstddef>

namespace packet {

/// The number of threads that `requested` (0: all) comes to, at most those of the CPU. Throws
/// Error{kBadValue} if negative.
[[nodiscard]] int thread_count(int requested);

class Parallel {
public:
    explicit Parallel(int requested) : threads_(thread_count(requested)) {}
    [[nodiscard]] int threads() const noexcept { return threads_; }

    /// Runs fn() where the other members spread their work over this many threads.
    template <class Fn>
    void run(Fn&& fn) const {
        if (threads_ == 1) {
            fn();
        } else {
            tbb::task_arena(threads_).execute(fn);
        }
    }
    /// fn(begin, end) for pieces of [0, count) of `grain` items each, the last one shorter. The
    /// pieces do not depend on the number of threads.
    template <class Fn>
    void for_pieces(std::size_t count, std::size_t grain, Fn&& fn) const {
        const std::size_t pieces = (count + grain - 1) / grain;
        const auto piece = [&](std::size_t i) { fn(i * grain, std::min(count, (i + 1) * grain)); };
        if (threads_ == 1 || pieces <= 1) {
            for (std::size_t i = 0; i < pieces; ++i) piece(i);
        } else {
            tbb::parallel_for(std::size_t{0}, pieces, piece);
        }
    }
    template <class A, class B>
    void both(A&& a, B&& b) const {
        if (threads_ == 1) {
            a();
            b();
        } else {
            tbb::parallel_invoke(a, b);
        }
    }

private:
    int threads_;
};

}  // namespace packet
