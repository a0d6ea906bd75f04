// Lanes of a packet that go on one by one, where so few are left that eight boxes or triangles at
// once keep more lanes busy than the packet does.
#pragma once

#include "kernels/leaf.h"
#include "kernels/single_walk.h"

namespace packet {

/// The rays of a packet, ray_of(lane) each, and their best hits.
template <Query query, int N, class Isa, class RayOf>
class LoneLanes {
public:
    PACKET_INLINE LoneLanes(const TreeView& tree, const RayOf& ray_of, std::int32_t instance_id,
                            BestHits<N, Isa>& best)
        : tree_(tree), ray_of_(ray_of), instance_id_(instance_id), best_(best) {
        best.t.store(best_t_);
    }

    /// The lanes of `active` walk the subtree of `child`.
    template <class Stats>
    PACKET_INLINE void walk(const WideChild& child, Mask<N, Isa> active, Stats& stats) {
        for (std::uint32_t left = active.bits(); left != 0; left &= left - 1) {
            const int lane = __builtin_ctz(left);
            if (query == Query::kAny && best_t_[lane] == kNever) continue;
            const auto& alone = ray_of_(lane);
            walk_wide_tree<query, Isa>(
                tree_, alone, best_t_[lane], stats,
                [&](std::uint32_t first, std::uint32_t item_count) {
                    stats.triangles(static_cast<int>(item_count));
                    const BlockRange range{first, item_count};
                    for (std::uint32_t b = range.begin(); b < range.end(); ++b) {
                        meet(tree_.blocks[b], lane, opaque(alone));
                        if (query == Query::kAny && best_t_[lane] == kNever) return;
                    }
                },
                child);
        }
    }

private:
    template <class Ray>
    PACKET_INLINE void meet(const TriangleBlock& block, int lane, const Ray& ray) {
        const auto shear = shear_of<kBlockSize, Isa>(ray);
        if constexpr (query == Query::kAny) {
            if (!is_occluded(shear, ray, best_t_[lane], block)) return;
            best_.occlude(lane);
            best_t_[lane] = kNever;
        } else {
            meet_block(shear, ray, best_t_[lane], block, [&](const BlockHit& hit) {
                best_.update(hit, instance_id_, lane);
                best_t_[lane] = hit.t;
            });
        }
    }

    const TreeView& tree_;
    const RayOf& ray_of_;
    std::int32_t instance_id_;
    BestHits<N, Isa>& best_;
    float best_t_[N];  ///< as in best_
};

}  // namespace packet
