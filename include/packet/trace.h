// Tracing: closest-hit and any-hit, for one ray, packets, spans of rays and images.
#pragma once

#include <packet/hit.h>
#include <packet/isa.h>
#include <packet/ray.h>
#include <packet/scene.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>

namespace packet {

/// How rays walk the structure. All modes return the same hits.
enum class Mode : std::uint8_t {
    kAuto,      ///< looks at the rays, or tries some of them, and picks
    kSingle,    ///< one ray at a time
    kPacket8,   ///< 8 rays share one stack
    kPacket16,  ///< 16 rays share one stack
    kTile,      ///< up to 128 rays share one stack and a beam around them, as far as they cohere
    kStream,    ///< incoherent rays by the thousand: sorted, then up to 64 share one stack. From
                ///< 131,072 rays on that start anywhere, sorting takes 4 bytes a ray and 64 MB
    kTreelet    ///< incoherent rays by the million in scenes far larger than the cache: those that
                ///< meet a part of the tree go through it together. Where the scene is not one
                ///< tree, or not cut into treelets, as kStream
};

struct ModeName {
    Mode mode;
    std::string_view name;
};
[[nodiscard]] std::span<const ModeName> mode_names() noexcept;
[[nodiscard]] std::string_view to_string(Mode mode) noexcept;
/// Throws Error{kUnknownName} that lists the valid names.
[[nodiscard]] Mode parse_mode(std::string_view name);

/// What `Mode::kTreelet` does besides: how rays and treelets come together.
struct TreeletTraceStats {
    std::uint64_t loads = 0;          ///< times that a treelet was gone through by waiting rays
    std::uint64_t entries = 0;        ///< rays that entered treelets, each as often as it did
    std::uint64_t streams = 0;        ///< of up to 64 rays, that did so
    std::uint64_t treelet_bytes = 0;  ///< of all loads, if each reads all of its treelet
    std::uint64_t queue_bytes = 0;    ///< written and read for rays that waited
    std::uint64_t peak_queued = 0;    ///< most rays that waited at a time, by the thread with most

    TreeletTraceStats& operator+=(const TreeletTraceStats& other) noexcept;
    [[nodiscard]] double rays_per_load() const noexcept;
    [[nodiscard]] double stream_utilization() const noexcept;  ///< rays of 64 in a stream
};

/// Work counted while tracing.
struct TraceStats {
    std::uint64_t rays = 0;
    std::uint64_t nodes = 0;         ///< inner nodes visited, summed over lanes
    std::uint64_t triangles = 0;     ///< triangles met, summed over lanes
    std::uint64_t lanes_active = 0;  ///< lanes that took part in visits of nodes
    std::uint64_t lanes_issued = 0;  ///< lanes that were paid for in them
    TreeletTraceStats treelets;

    TraceStats& operator+=(const TraceStats& other) noexcept;
    [[nodiscard]] double nodes_per_ray() const noexcept;
    [[nodiscard]] double triangles_per_ray() const noexcept;
    [[nodiscard]] double lane_utilization() const noexcept;
};

struct TraceOptions {
    Mode mode = Mode::kAuto;
    /// Threads to trace with, at most the CPU's; 0 takes all of them, 1 starts none.
    int threads = 0;
    /// If not 0, the rays are an image's in scanline order, this many to a line. They are then
    /// traced in square tiles, which cohere better; the hits keep the rays' order. If 0, `kAuto`
    /// and `kTile` look whether 1,024 rays or more are an image's, in scanlines or in blocks.
    int width = 0;
    /// Kernels to use; without a value default_isa().
    std::optional<IsaId> isa;
    /// For `kTreelet`: bytes for rays that wait, divided among threads: 8 a ray and a treelet that
    /// it waits at. Where they do not suffice, rays go on without waiting. Some 50 bytes a treelet,
    /// and 1 MB, come on top for each thread. Rays are traced 4 million at a time, which takes 60
    /// bytes a ray.
    std::size_t queue_bytes = std::size_t{256} << 20;
    /// For `kTreelet`: queues grow by so many rays at a time, 1 to 65536. Fewer waste less memory.
    int queue_chunk = 256;
    /// Told what fraction of the rays is traced, as BuildOptions::progress is: false ends the call
    /// with Error{kCancelled}; the results are then those of some of the rays.
    std::function<bool(float fraction)> progress;
    /// If set, work is counted into it (added to what it holds). Counting costs time.
    TraceStats* stats = nullptr;
};

/// Closest hits of many rays: hits[i] belongs to rays[i]. Throws Error{kBadValue} if the spans
/// differ in length, `threads` or `width` is negative, Error{kNotCommitted}, Error{kUnsupported}.
void trace_closest(const Scene& scene, std::span<const Ray> rays, std::span<Hit> hits,
                   const TraceOptions& options = {});
/// Whether anything is hit: occluded[i] is 1 if rays[i] hits something, else 0. Errors as above.
void trace_any(const Scene& scene, std::span<const Ray> rays, std::span<std::uint8_t> occluded,
               const TraceOptions& options = {});

/// Closest hit of one ray, on this thread. Many at once take 0.15 to 0.7 of the time, a ray. Throws
/// Error{kNotCommitted}.
[[nodiscard]] Hit trace_closest(const Scene& scene, const Ray& ray);
/// Whether one ray hits anything, likewise.
[[nodiscard]] bool trace_any(const Scene& scene, const Ray& ray);

/// Closest hits of one packet, on this thread. Inactive lanes of `rays` are not read and those of
/// `hits` not written.
template <int N>
void trace_closest(const Scene& scene, const RayPacket<N>& rays, LaneMask<N> active,
                   HitPacket<N>& hits);
/// The active lanes that hit anything.
template <int N>
[[nodiscard]] LaneMask<N> trace_any(const Scene& scene, const RayPacket<N>& rays,
                                    LaneMask<N> active);

extern template void trace_closest<8>(const Scene&, const Ray8&, LaneMask<8>, Hit8&);
extern template void trace_closest<16>(const Scene&, const Ray16&, LaneMask<16>, Hit16&);
extern template LaneMask<8> trace_any<8>(const Scene&, const Ray8&, LaneMask<8>);
extern template LaneMask<16> trace_any<16>(const Scene&, const Ray16&, LaneMask<16>);

/// A rectangle of pixels, `x1` and `y1` exclusive.
struct Tile {
    int x0, y0, x1, y1;
    [[nodiscard]] int pixel_count() const noexcept { return (x1 - x0) * (y1 - y0); }
};

/// Fills one ray for each pixel of a tile, in scanline order within the tile.
using GenerateTile = std::function<void(Tile, std::span<Ray>)>;
/// Takes the hits of a tile, ordered as its rays. Called from many threads, for different tiles.
using ConsumeTile = std::function<void(Tile, std::span<const Ray>, std::span<const Hit>)>;

/// Traces an image of `width` x `height` pixels tile by tile, tiles spread over the threads: rays
/// are made, traced and consumed while they are in the cache. Exceptions of the callbacks pass on.
void trace_tiles(const Scene& scene, int width, int height, const GenerateTile& generate,
                 const ConsumeTile& consume, const TraceOptions& options = {});

}  // namespace packet
