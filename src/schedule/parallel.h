// Spreads loops and pairs of tasks over threads. With one thread everything runs on the caller's,
// and TBB is not touched; with more, in an arena of that many, so that no global setting is
// changed. What a task throws ends the loop that it belongs to. Loops within other tasks run on:
// ended from outside they would return as if they had done all their work. Tasks that may be told
// to end find out by check().
#pragma once

#include "schedule/fork_join.h"
#include "schedule/progress.h"

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
    /// For a job whose progress is told, if it is wanted.
    Parallel(int requested, Progress& progress)
        : threads_(thread_count(requested)),
          progress_(progress.is_wanted() ? &progress : nullptr) {}
    /// For a part of a job that is `share` of it, on so many threads: what it advances counts for
    /// so much less.
    [[nodiscard]] Parallel part(int threads, double share) const {
        Parallel out = *this;
        out.threads_ = threads;
        out.scale_ *= share;
        return out;
    }
    [[nodiscard]] int threads() const noexcept { return threads_; }
    /// Whether anybody wants to know of progress.
    [[nodiscard]] bool is_watched() const noexcept { return progress_ != nullptr; }

    /// Runs fn() where the other members spread their work over this many threads.
    template <class Fn>
    void run(Fn&& fn) const {
        if (threads_ == 1 || tbb::this_task_arena::max_concurrency() == threads_) {
            fn();  // also within another run(): a new arena waits for its threads to wake up
        } else {
            tbb::task_arena(threads_).execute(fn);
        }
    }
    /// Throws Stopped if the job is to end. For loops that take milliseconds, every few thousand
    /// turns; costs nothing if nobody wants to know of progress.
    void check() const {
        if (progress_ != nullptr) progress_->check();
    }
    /// `part` of the job's phase is done; then as check().
    void advance(double part) const {
        if (progress_ == nullptr) return;
        progress_->advance(scale_ * part);
        progress_->check();
    }
    /// fn(begin, end) for pieces of [0, count) of `grain` items each, the last one shorter, with a
    /// check() before each. The pieces do not depend on the number of threads.
    template <class Fn>
    void for_pieces(std::size_t count, std::size_t grain, Fn&& fn) const {
        const std::size_t pieces = (count + grain - 1) / grain;
        const auto piece = [&](std::size_t i) {
            check();
            fn(i * grain, std::min(count, (i + 1) * grain));
        };
        if (threads_ == 1 || pieces <= 1) {
            for (std::size_t i = 0; i < pieces; ++i) piece(i);
        } else {
            tbb::task_group_context context(tbb::task_group_context::isolated);
            tbb::parallel_for(std::size_t{0}, pieces, ForkJoin(piece), context);
        }
    }
    template <class A, class B>
    void both(A&& a, B&& b) const {
        if (threads_ == 1) {
            a();
            b();
        } else {
            tbb::task_group_context context(tbb::task_group_context::isolated);
            const ForkJoin first(a);
            const ForkJoin second(b);
            tbb::parallel_invoke(first, second, context);
        }
    }

private:
    int threads_;
    Progress* progress_ = nullptr;
    double scale_ = 1.0;  ///< of what is advanced
};

}  // namespace packet
