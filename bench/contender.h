// Those that trace the same rays side by side: ours in each mode, and Embree in each of its own.
#pragma once

#include "embree_reference.h"
#include "ray_set.h"

#include <packet/hit.h>
#include <packet/scene.h>
#include <packet/trace.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace packet::bench {

enum class Side : std::uint8_t { kOurs, kEmbree };

/// Hits for Query::kClosest, bytes for Query::kAny; the other one is empty.
struct Answers {
    std::vector<Hit> hits;
    std::vector<std::uint8_t> occluded;
};
/// Room for the answers to a set of rays.
[[nodiscard]] Answers room_for(const RaySet& set);

/// One way to trace a set of rays.
struct Contender {
    Side side;
    std::string name;
    /// From rays in memory to answers in memory: what is timed. Ours answers in the order of
    /// RaySet::rays, Embree in that of block_rays.
    std::function<void(const RaySet&, Answers&, int threads)> trace;
    /// The closest hits of the given rays, in their order.
    std::function<void(std::span<const Ray>, std::span<Hit>)> closest;
};

/// The scene must outlive the contender.
[[nodiscard]] Contender our_contender(const Scene& scene, const ModeName& name);
/// A call for each ray, as renderers do that have one ray at a time.
[[nodiscard]] Contender calling_contender(const Scene& scene);
/// Keeps a copy of the scene. `tree` names how it was built, in the contender's name.
[[nodiscard]] Contender embree_contender(const EmbreeScene& scene, const EmbreeModeName& name,
                                         std::string_view tree);

/// Answers in the order of RaySet::rays, and the seconds that tracing took.
[[nodiscard]] std::pair<Answers, double> answers_of(const Contender& contender, const RaySet& set,
                                                    int threads);

}  // namespace packet::bench
