#include "device_timing.h"

#include "device_scene.h"

namespace packet::cuda {

namespace {

class Event {
public:
    Event() { check(cudaEventCreate(&event_), "cudaEventCreate"); }
    ~Event() { cudaEventDestroy(event_); }
    Event(const Event&) = delete;
    Event& operator=(const Event&) = delete;

    void record(const Stream& stream) {
        check(cudaEventRecord(event_, stream.get()), "cudaEventRecord");
    }
    /// Both have been reached.
    [[nodiscard]] double seconds_since(const Event& start) const {
        float milliseconds = 0.0f;
        check(cudaEventElapsedTime(&milliseconds, start.event_, event_), "cudaEventElapsedTime");
        return 1e-3 * static_cast<double>(milliseconds);
    }

private:
    cudaEvent_t event_ = nullptr;
};

}  // namespace

std::vector<double> time_traces(const DeviceScene& scene, std::span<const Ray> rays,
                                const DeviceTraceOptions& options, int repeats) {
    const Stream stream;
    const auto count = static_cast<std::uint32_t>(rays.size());
    DeviceRays on_device(count);
    on_device.rays.copy_from(rays, stream.get());
    std::vector<double> seconds;
    for (int repeat = 0; repeat <= repeats; ++repeat) {
        Event start, end;
        start.record(stream);
        trace_on_device(scene.impl(), on_device, count, options, Query::kClosest, stream.get());
        end.record(stream);
        stream.synchronize();
        if (repeat > 0) seconds.push_back(end.seconds_since(start));
    }
    return seconds;
}

}  // namespace packet::cuda
