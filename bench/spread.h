// Rays spread over threads, for what takes them by the call.
#pragma once

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>

namespace packet::bench {

/// Calls trace(first, count) for pieces of `all` rays, of `task_size` but for the last; one thread
/// takes them all at once.
template <class Trace>
void spread(std::size_t all, std::size_t task_size, int threads, const Trace& trace) {
    if (threads == 1) return trace(std::size_t{0}, all);
    const std::size_t task_count = (all + task_size - 1) / task_size;
    tbb::task_arena(threads).execute([&] {
        tbb::parallel_for(std::size_t{0}, task_count, [&](std::size_t task) {
            const std::size_t first = task * task_size;
            trace(first, std::min(task_size, all - first));
        });
    });
}

}  // namespace packet::bench
