#include "contender.h"

#include "spread.h"

#include <timing.h>

#include <cstddef>
#include <utility>

namespace packet::bench {
namespace {

template <class Answer>
void to_ray_order(const RaySet& set, std::vector<Answer>& answers) {
    std::vector<Answer> ordered(answers.size());
    for (std::size_t i = 0; i < answers.size(); ++i) ordered[set.block_order[i]] = answers[i];
    answers = std::move(ordered);
}

}  // namespace

Answers room_for(const RaySet& set) {
    Answers answers;
    if (set.query == Query::kClosest) answers.hits.resize(set.rays.size());
    if (set.query == Query::kAny) answers.occluded.resize(set.rays.size());
    return answers;
}

Contender our_contender(const Scene& scene, const ModeName& name) {
    TraceOptions base;
    base.mode = name.mode;
    const auto trace = [&scene, base](const RaySet& set, Answers& answers, int threads) {
        TraceOptions options = base;
        options.threads = threads;
        options.width = set.width;
        if (set.query == Query::kClosest) trace_closest(scene, set.rays, answers.hits, options);
        if (set.query == Query::kAny) trace_any(scene, set.rays, answers.occluded, options);
    };
    const auto closest = [&scene, base](std::span<const Ray> rays, std::span<Hit> hits) {
        trace_closest(scene, rays, hits, base);
    };
    return {Side::kOurs, std::string(name.name), trace, closest};
}

Contender calling_contender(const Scene& scene) {
    constexpr std::size_t kTaskSize = 4096;  // rays
    const auto trace = [&scene](const RaySet& set, Answers& answers, int threads) {
        spread(set.rays.size(), kTaskSize, threads, [&](std::size_t first, std::size_t count) {
            for (std::size_t i = first; i < first + count; ++i) {
                const Ray& ray = set.rays[i];
                if (set.query == Query::kClosest) answers.hits[i] = trace_closest(scene, ray);
                if (set.query == Query::kAny) answers.occluded[i] = trace_any(scene, ray) ? 1 : 0;
            }
        });
    };
    const auto closest = [&scene](std::span<const Ray> rays, std::span<Hit> hits) {
        for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = trace_closest(scene, rays[i]);
    };
    return {Side::kOurs, "call", trace, closest};
}

Contender embree_contender(const EmbreeScene& scene, const EmbreeModeName& name,
                           std::string_view tree) {
    const EmbreeMode mode = name.mode;
    const auto trace = [scene, mode](const RaySet& set, Answers& answers, int threads) {
        const std::span<const Ray> rays = set.block_rays;
        if (set.query == Query::kClosest) scene.trace_closest(mode, rays, answers.hits, threads);
        if (set.query == Query::kAny) scene.trace_any(mode, rays, answers.occluded, threads);
    };
    const auto closest = [scene, mode](std::span<const Ray> rays, std::span<Hit> hits) {
        scene.trace_closest(mode, rays, hits);
    };
    return {Side::kEmbree, std::string(name.name).append(" ").append(tree), trace, closest};
}

std::pair<Answers, double> answers_of(const Contender& contender, const RaySet& set, int threads) {
    Answers answers = room_for(set);
    const double seconds = tools::seconds_of([&] { contender.trace(set, answers, threads); });
    if (contender.side == Side::kEmbree) {
        to_ray_order(set, answers.hits);
        to_ray_order(set, answers.occluded);
    }
    return {std::move(answers), seconds};
}

}  // namespace packet::bench
