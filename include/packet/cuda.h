// Tracing on a CUDA device: the same scenes, rays and hits, the same answer bit for bit.
#pragma once

#include <packet/hit.h>
#include <packet/ray.h>
#include <packet/scene.h>
#include <packet/trace.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace packet::cuda {

/// How the device walks a scene with rays. All return the same hits.
enum class DeviceMode : std::uint8_t {
    kAuto,    ///< looks at the rays and picks kWarp or kThread
    kWarp,    ///< 32 rays share one stack
    kThread,  ///< each ray on its own, 32 in step
    kSorted   ///< sorts the rays by where they start and go, then as kWarp
};

struct DeviceModeName {
    DeviceMode mode;
    std::string_view name;
};
[[nodiscard]] std::span<const DeviceModeName> device_mode_names() noexcept;
[[nodiscard]] std::string_view to_string(DeviceMode mode) noexcept;
/// Throws Error{kUnknownName} that lists the valid names.
[[nodiscard]] DeviceMode parse_device_mode(std::string_view name);

struct DeviceTraceOptions {
    DeviceMode mode = DeviceMode::kAuto;
    /// As TraceOptions::width. With kSorted it says nothing.
    int width = 0;
    /// As TraceOptions::stats. Where 32 rays share a stack, 32 lanes are paid for at each node.
    TraceStats* stats = nullptr;
};

/// The name of the device that a DeviceScene would use. Throws Error{kUnsupported} that says why if
/// there is none: no device, no driver, or a library that was built without CUDA.
[[nodiscard]] std::string device_name();

/// A scene in the memory of the current device. It does not change with the scene that it
/// was made of, which may go. Rays may be traced from several threads at once.
class DeviceScene {
public:
    /// Copies the scene's structures: per triangle 48 bytes, per node 32. Throws
    /// Error{kNotCommitted}, Error{kUnsupported} as device_name() does, if the device's memory does
    /// not suffice, for grids, which only the CPU walks, and for scenes committed without
    /// BuildOptions::keep_binary_nodes.
    explicit DeviceScene(const Scene& scene);
    /// Builds the structures on the device, of a scene that need not be committed: only meshes and
    /// instances travel there. `options.accel` is kBvhMorton (also kBvh of quality kFast) or
    /// kKdSah, breadth-first; the tree is the CPU's, node for node. `progress` is not told. Takes,
    /// while it builds, per reference about 150 bytes for the first and 350 for the second. Throws
    /// as above, Error{kUnsupported} for any other structure, Error{kBadValue} for options as
    /// commit() does, and Error{kTooLarge} where references that cuts may add come to more than
    /// 2^29.
    DeviceScene(const Scene& scene, const BuildOptions& options);
    ~DeviceScene();
    DeviceScene(DeviceScene&&) noexcept;
    DeviceScene& operator=(DeviceScene&&) noexcept;

    /// Closest hits of rays in the host's memory: hits[i] belongs to rays[i]. Copies and traces a
    /// million or so at a time. Throws Error{kBadValue} if the spans differ in length or `width` is
    /// negative, Error{kUnsupported} if the device fails.
    void trace_closest(std::span<const Ray> rays, std::span<Hit> hits,
                       const DeviceTraceOptions& options = {}) const;
    /// Whether anything is hit: 1 or 0. Errors as above.
    void trace_any(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                   const DeviceTraceOptions& options = {}) const;

    struct Impl;
    /// For the library's own layers.
    [[nodiscard]] const Impl& impl() const noexcept { return *impl_; }

private:
    std::unique_ptr<Impl> impl_;
};

}  // namespace packet::cuda
