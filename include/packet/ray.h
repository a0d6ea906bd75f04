// Rays: one, and packets of them as a structure of arrays.
#pragma once

#include <glm/vec3.hpp>

#include <cstdint>
#include <limits>
#include <type_traits>

namespace packet {

/// The closed segment `org + t * dir`, `tnear <= t <= tfar`. `dir` need not be normalised: `t`
/// counts in units of `dir`. A ray with a NaN, an infinite origin or direction, or a direction so
/// short that 1 / dir overflows (the zero direction among them) hits nothing.
struct Ray {
    glm::vec3 org{0.0f};
    float tnear = 0.0f;
    glm::vec3 dir{0.0f, 0.0f, 1.0f};
    float tfar = std::numeric_limits<float>::infinity();
};
static_assert(sizeof(Ray) == 32 && std::is_trivially_copyable_v<Ray>);

/// Which of a packet's N lanes take part. Lane i is bit i.
template <int N>
struct LaneMask {
    static_assert(N >= 1 && N <= 32);
    static constexpr std::uint32_t kAllBits =
        static_cast<std::uint32_t>((std::uint64_t{1} << N) - 1);

    std::uint32_t bits = kAllBits;

    [[nodiscard]] static constexpr LaneMask all() noexcept { return {kAllBits}; }
    [[nodiscard]] static constexpr LaneMask none() noexcept { return {0}; }
    [[nodiscard]] static constexpr LaneMask first(int count) noexcept {
        return {static_cast<std::uint32_t>((std::uint64_t{1} << count) - 1) & kAllBits};
    }
    [[nodiscard]] constexpr bool test(int lane) const noexcept { return (bits >> lane & 1u) != 0; }
    constexpr void set(int lane) noexcept { bits |= 1u << lane; }
    constexpr void clear(int lane) noexcept { bits &= ~(1u << lane); }

    friend constexpr bool operator==(LaneMask, LaneMask) noexcept = default;
};

/// N rays as a structure of arrays, one array a component.
template <int N>
struct alignas(4 * N) RayPacket {
    float org_x[N], org_y[N], org_z[N], tnear[N];
    float dir_x[N], dir_y[N], dir_z[N], tfar[N];

    RayPacket() noexcept {
        for (int lane = 0; lane < N; ++lane) set(lane, Ray{});
    }
    void set(int lane, const Ray& ray) noexcept {
        org_x[lane] = ray.org.x, org_y[lane] = ray.org.y, org_z[lane] = ray.org.z;
        dir_x[lane] = ray.dir.x, dir_y[lane] = ray.dir.y, dir_z[lane] = ray.dir.z;
        tnear[lane] = ray.tnear, tfar[lane] = ray.tfar;
    }
    [[nodiscard]] Ray get(int lane) const noexcept {
        return {{org_x[lane], org_y[lane], org_z[lane]},
                tnear[lane],
                {dir_x[lane], dir_y[lane], dir_z[lane]},
                tfar[lane]};
    }
};

using Ray8 = RayPacket<8>;
using Ray16 = RayPacket<16>;

}  // namespace packet
