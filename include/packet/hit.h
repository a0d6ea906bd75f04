// Hits: what a ray met, one and as packets.
#pragma once

#include <cstdint>
#include <limits>
#include <type_traits>

namespace packet {

/// The id of nothing: a hit whose `prim_id` is this is a miss.
inline constexpr std::uint32_t kInvalidId = 0xFFFFFFFFu;

/// The nearest hit of a ray. The point is `org + t * dir`, and also `(1-u-v) v0 + u v1 + v v2`.
/// A miss has `t = inf`, `u = v = 0` and ids `kInvalidId`, as has a default one.
struct Hit {
    float t = std::numeric_limits<float>::infinity();
    float u = 0.0f;
    float v = 0.0f;
    std::uint32_t prim_id = kInvalidId;
    std::uint32_t mesh_id = kInvalidId;
    std::uint32_t instance_id = kInvalidId;

    [[nodiscard]] bool is_hit() const noexcept { return prim_id != kInvalidId; }
    friend bool operator==(const Hit&, const Hit&) = default;
};
static_assert(sizeof(Hit) == 24 && std::is_trivially_copyable_v<Hit>);

/// N hits as a structure of arrays.
template <int N>
struct alignas(4 * N) HitPacket {
    float t[N], u[N], v[N];
    std::uint32_t prim_id[N], mesh_id[N], instance_id[N];

    HitPacket() noexcept {
        for (int lane = 0; lane < N; ++lane) set(lane, Hit{});
    }
    void set(int lane, const Hit& hit) noexcept {
        t[lane] = hit.t, u[lane] = hit.u, v[lane] = hit.v;
        prim_id[lane] = hit.prim_id, mesh_id[lane] = hit.mesh_id;
        instance_id[lane] = hit.instance_id;
    }
    [[nodiscard]] Hit get(int lane) const noexcept {
        return {t[lane], u[lane], v[lane], prim_id[lane], mesh_id[lane], instance_id[lane]};
    }
};

using Hit8 = HitPacket<8>;
using Hit16 = HitPacket<16>;

}  // namespace packet
