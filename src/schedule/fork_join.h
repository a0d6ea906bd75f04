// Tells the thread sanitizer what it cannot see: that tasks begin after their fork and end before
// their join. TBB, which sees to that, is not instrumented. In all other builds this does nothing.
#pragma once

#ifdef PACKET_TSAN
#include <sanitizer/tsan_interface.h>
#endif

namespace packet {

/// Lives from the fork to the join; each call is a task.
template <class Fn>
class ForkJoin {
public:
    explicit ForkJoin(const Fn& fn) : fn_(fn) { release(fork_); }
    ~ForkJoin() { acquire(join_); }
    ForkJoin(const ForkJoin&) = delete;
    ForkJoin& operator=(const ForkJoin&) = delete;

    template <class... Args>
    void operator()(Args... args) const {
        acquire(fork_);
        const End end{join_};
        fn_(args...);
    }

private:
    struct End {
        char& join;
        ~End() { release(join); }
    };
#ifdef PACKET_TSAN
    static void acquire(char& point) { __tsan_acquire(&point); }
    static void release(char& point) { __tsan_release(&point); }
#else
    static void acquire(char&) {}
    static void release(char&) {}
#endif

    const Fn& fn_;
    // Two points: at a single one tasks would wait for each other, as it would seem.
    mutable char fork_ = 0, join_ = 0;
};

}  // namespace packet
