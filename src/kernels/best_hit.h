// The nearest hits so far, one a lane, and the rule that makes them unique.
#pragma once

#include "kernels/ray_setup.h"

namespace packet {

enum class Query { kClosest, kAny };

inline constexpr float kNever = -__builtin_huge_valf();
inline constexpr std::int32_t kNoId = 0x7FFFFFFF;  // greater than any id, so any id wins a tie

template <int N, class Isa>
struct BestHits {
    using F = Float<N, Isa>;
    using I = Int<N, Isa>;
    using M = Mask<N, Isa>;

    /// Farther than this nothing counts. kNever in lanes that take no part, or no longer do: then
    /// no comparison with it holds, and no other mask is needed.
    F t;
    F u, v;
    I prim_id, instance_id;
    /// At equal t a hit counts if its prim_id is less than this: prim_id within an instance; across
    /// instances all or nothing, as the order of the instances says.
    I tie_prim_id;

    BestHits() = default;
    PACKET_INLINE BestHits(const F& tfar, M active) { reset(tfar, active); }

    PACKET_INLINE void reset(const F& tfar, M active) {
        t = select(active, min(tfar, F(kLargestFloat)), F(kNever));
        u = v = 0.0f;
        prim_id = instance_id = tie_prim_id = kNoId;
    }
    PACKET_INLINE void enter_instance(std::int32_t id) {
        tie_prim_id = select(I(id) < instance_id, I(kNoId), I(-1));
    }
    /// For any-hit, where no more is asked than that there is one: lanes that need look no further.
    PACKET_INLINE void occlude(M hit) {
        t = select(hit, F(kNever), t);
        prim_id = select(hit, I(0), prim_id);
    }
    /// `hit` lanes have new_t <= t.
    template <Query query>
    PACKET_INLINE void update(M hit, const F& new_t, const F& new_u, const F& new_v,
                              const I& new_prim_id, std::int32_t instance) {
        if constexpr (query == Query::kAny) {
            occlude(hit);
        } else {
            // if (new_t < t || new_prim_id < tie_prim_id) take it
            const M closer = hit & ((new_t < t) | (new_prim_id < tie_prim_id));
            t = select(closer, new_t, t);
            u = select(closer, new_u, u);
            v = select(closer, new_v, v);
            prim_id = select(closer, new_prim_id, prim_id);
            tie_prim_id = select(closer, new_prim_id, tie_prim_id);
            instance_id = select(closer, I(instance), instance_id);
        }
    }
    /// A hit of one lane.
    template <class Hit>
    PACKET_INLINE void update(const Hit& hit, std::int32_t instance, std::uint32_t lane_bit = 1) {
        update<Query::kClosest>(M::from_bits(lane_bit), hit.t, hit.u, hit.v, hit.prim_id, instance);
    }
    PACKET_INLINE M found() const { return prim_id < I(kNoId); }
};

}  // namespace packet
