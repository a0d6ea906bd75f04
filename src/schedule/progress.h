// How far a job of many threads is, told to whoever asked for it, who may end the job.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>

namespace packet {

/// Thrown on the threads of a job that is to end; with_progress() turns it into what ended the job.
struct Stopped {};

class Progress {
public:
    /// Takes the fraction that is done and returns whether to go on. Called by one thread at a time
    /// with fractions that never decrease; what it throws ends the job.
    using Report = std::function<bool(float)>;

    /// `job` is what an error says was cancelled.
    Progress(const Report& report, const char* job) : report_(report), job_(job) {}
    [[nodiscard]] bool is_wanted() const noexcept { return report_ != nullptr; }

    /// From here on parts are those of a phase, which is `share` of the job. For the thread that
    /// runs the job, while it runs alone.
    void start_phase(double share) noexcept;
    /// `part` of the phase is done, 1 in sum.
    void advance(double part) noexcept { part_.fetch_add(part, std::memory_order_relaxed); }
    /// Reports, if that is due, unless another thread does so. Throws Stopped if the job is to end.
    /// To be called every few milliseconds at least; takes about 30 ns.
    void check();
    /// Reports now, by the thread that runs the job: the start of all, or with 1 its end.
    void report(float fraction);
    /// What ended the job.
    [[noreturn]] void rethrow() const { std::rethrow_exception(failure_); }

private:
    [[nodiscard]] float fraction() const noexcept;
    void tell(float fraction);

    const Report& report_;
    const char* job_;
    double base_ = 0.0, share_ = 0.0;  ///< done before this phase, and in it
    std::atomic<double> part_{0.0};
    std::atomic<std::int64_t> next_time_{0};  ///< of the steady clock
    std::atomic<float> next_fraction_{0.0f};
    /// Not a mutex: a report that runs tasks of its own may come back here.
    std::atomic_flag is_telling_ = ATOMIC_FLAG_INIT;
    std::atomic<bool> is_stopped_{false};
    std::exception_ptr failure_;
};

/// Runs fn(progress) and returns its result. If the report says no, throws Error{kCancelled}; if it
/// throws, that.
template <class Fn>
auto with_progress(const Progress::Report& report, const char* job, Fn fn) {
    Progress progress(report, job);
    try {
        progress.report(0.0f);
        auto result = fn(progress);
        progress.report(1.0f);
        return result;
    } catch (const Stopped&) {
        progress.rethrow();
    }
}

}  // namespace packet
