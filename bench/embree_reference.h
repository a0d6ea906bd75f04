// Embree behind one small interface, to compare with: one mesh, our rays in, our hits out. It is
// version 3 (Debian 12) or 4 (Debian 13), whichever is installed.
#pragma once

#include <packet/hit.h>
#include <packet/mesh.h>
#include <packet/ray.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

struct RTCSceneTy;

namespace packet::bench {

/// How much Embree spends on its tree. High splits triangles; low is made for animation.
enum class EmbreeQuality : std::uint8_t { kLow, kMedium, kHigh };

/// Embree's default triangle test may let a ray slip between two triangles; its robust one is
/// slower and mends most of that. Ours never does.
enum class EmbreeTest : std::uint8_t { kFast, kRobust };

/// How rays are handed over: one by one, in packets, or in streams (version 3 only). The coherent
/// ones pass Embree's hint that neighbouring rays go alike.
enum class EmbreeMode : std::uint8_t { k1, k8, k8Coherent, k16, k16Coherent, k1M, k1MCoherent };

/// What it took Embree to build.
struct EmbreeBuild {
    double seconds;     ///< from arrays in memory to what can be traced
    std::size_t bytes;  ///< of what is left then, but for the arrays
};

struct EmbreeModeName {
    EmbreeMode mode;
    std::string_view name;
};
/// The modes of the installed version.
[[nodiscard]] std::span<const EmbreeModeName> embree_modes() noexcept;
/// Such as "Embree 3.13.5".
[[nodiscard]] std::string_view embree_version() noexcept;

/// A mesh in Embree. The arrays are copied; their indices must be valid. Copies share the scene.
/// Threads keep their floating point settings: denormals are not flushed on Embree's behalf.
class EmbreeScene {
public:
    /// Throws std::runtime_error with Embree's message if it refuses.
    explicit EmbreeScene(MeshView mesh, EmbreeQuality quality = EmbreeQuality::kMedium,
                         EmbreeTest test = EmbreeTest::kFast);

    [[nodiscard]] const EmbreeBuild& build() const noexcept { return build_; }

    /// As packet::trace_closest, with mesh and instance 0. Among hits at equal `t` any may be
    /// returned. Rays need finite components and `0 <= tnear`. `threads` is 1 or more.
    void trace_closest(EmbreeMode mode, std::span<const Ray> rays, std::span<Hit> hits,
                       int threads = 1) const;
    /// As packet::trace_any.
    void trace_any(EmbreeMode mode, std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                   int threads = 1) const;

private:
    std::shared_ptr<RTCSceneTy> scene_;
    EmbreeBuild build_{};
};

}  // namespace packet::bench
