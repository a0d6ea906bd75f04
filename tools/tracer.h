// What traces the rays of an image: the CPU, or something else that gives the same hits.
#pragma once

#include <packet/trace.h>

#include <cstdint>
#include <span>

namespace packet::tools {

class Tracer {
public:
    virtual ~Tracer() = default;

    /// As trace_tiles() of the library.
    virtual void tiles(int width, int height, const GenerateTile& generate,
                       const ConsumeTile& consume) const = 0;
    // For consumers of tiles, who run on a thread of their own already.
    virtual void closest(std::span<const Ray> rays, std::span<Hit> hits,
                         TraceStats* stats = nullptr) const = 0;
    virtual void any(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const = 0;
};

class CpuTracer : public Tracer {
public:
    /// `scene` must outlive it.
    CpuTracer(const Scene& scene, const TraceOptions& options);

    void tiles(int width, int height, const GenerateTile& generate,
               const ConsumeTile& consume) const override;
    void closest(std::span<const Ray> rays, std::span<Hit> hits, TraceStats* stats) const override;
    void any(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const override;

private:
    const Scene& scene_;
    TraceOptions options_, options_in_tile_;
};

}  // namespace packet::tools
