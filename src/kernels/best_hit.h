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
    using PartFloat = Float<kPartSize<N, Isa>, Isa>;
    using PartInt = Int<kPartSize<N, Isa>, Isa>;
    using PartMask = Mask<kPartSize<N, Isa>, Isa>;

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
    /// For any-hit, where no more is asked than that there is one: lanes of register i that need
    /// look no further.
    PACKET_INLINE void occlude(int i, PartMask hit) {
        assign_part(t, i, hit, PartFloat(kNever));
        assign_part(prim_id, i, hit, PartInt(0));
    }
    /// Hits of lanes of register i, none of them behind t.
    PACKET_INLINE void update(int i, PartMask hit, const PartFloat& new_t, const PartFloat& new_u,
                              const PartFloat& new_v, const PartInt& new_prim_id,
                              std::int32_t instance) {
        // if (new_t < t || new_prim_id < tie_prim_id) take it
        const PartMask closer = hit & ((new_t < part(t, i)) | (new_prim_id < part(tie_prim_id, i)));
        assign_part(t, i, closer, new_t);
        assign_part(u, i, closer, new_u);
        assign_part(v, i, closer, new_v);
        assign_part(prim_id, i, closer, new_prim_id);
        assign_part(tie_prim_id, i, closer, new_prim_id);
        assign_part(instance_id, i, closer, PartInt(instance));
    }
    /// A hit of one lane.
    template <class Hit>
    PACKET_INLINE void update(const Hit& hit, std::int32_t instance, int lane = 0) {
        constexpr int kSize = kPartSize<N, Isa>;
        update(lane / kSize, PartMask::from_bits(1u << lane % kSize), hit.t, hit.u, hit.v,
               hit.prim_id, instance);
    }
    PACKET_INLINE void occlude(int lane) {
        constexpr int kSize = kPartSize<N, Isa>;
        occlude(lane / kSize, PartMask::from_bits(1u << lane % kSize));
    }
    PACKET_INLINE M found() const { return prim_id < I(kNoId); }
};

}  // namespace packet
