#include "contest.h"

#include <timing.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace packet::bench {
namespace {

// To runs of so many seconds it does not matter what the caches hold when they begin.
constexpr double kLongRun = 0.5;

template <class Answer>
Agreement compare_bits(const std::vector<Answer>& first, const std::vector<Answer>& other) {
    Agreement out;
    for (std::size_t i = 0; i < first.size(); ++i) {
        ++(first[i] == other[i] ? out.same : out.different);
    }
    return out;
}

// Whether anything is hit says too little to judge a difference by, so the closest hits of those
// rays do. Where even these agree, one of the two contradicts itself.
Agreement compare_occluded(MeshView mesh, std::span<const Ray> rays, const Contender& first,
                           const Answers& a, const Contender& other, const Answers& b) {
    std::vector<Ray> unlike;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (a.occluded[i] != b.occluded[i]) unlike.push_back(rays[i]);
    }
    std::vector<Hit> first_hits(unlike.size()), other_hits(unlike.size());
    first.closest(unlike, first_hits);
    other.closest(unlike, other_hits);
    const Agreement closest = compare_hits(mesh, unlike, first_hits, other_hits);
    return {.same = rays.size() - unlike.size(),
            .borderline = closest.borderline,
            .different = unlike.size() - closest.borderline};
}

Agreement compare_answers(MeshView mesh, const RaySet& set, const Contender& first,
                          const Answers& a, const Contender& other, const Answers& b) {
    if (other.side == Side::kOurs && set.query == Query::kAny) {
        return compare_bits(a.occluded, b.occluded);
    }
    if (other.side == Side::kOurs) return compare_bits(a.hits, b.hits);
    if (set.query == Query::kAny) return compare_occluded(mesh, set.rays, first, a, other, b);
    return compare_hits(mesh, set.rays, a.hits, b.hits);
}

}  // namespace

double Score::median_seconds() const { return tools::median(seconds); }

std::vector<Score> hold(const Contest& contest, MeshView mesh, const RaySet& set,
                        std::span<const Contender> contenders) {
    const Contender& first = contenders.front();
    Answers expected;
    std::vector<Score> scores;
    for (const Contender& contender : contenders) {
        auto [answers, seconds] = answers_of(contender, set, contest.threads);
        if (scores.empty()) expected = answers;
        const Agreement agreement = compare_answers(mesh, set, first, expected, contender, answers);
        scores.push_back({&contender, agreement, {}});
        if (seconds >= kLongRun) scores.back().seconds.push_back(seconds);
    }
    std::vector<std::size_t> order(scores.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::mt19937 random(1);
    Answers answers = room_for(set);
    for (int repeat = 1; repeat <= contest.repeats; ++repeat) {
        // None always follows the same other, which may leave it a slower processor.
        std::ranges::shuffle(order, random);
        for (const std::size_t index : order) {
            Score& score = scores[index];
            if (score.seconds.size() == static_cast<std::size_t>(repeat)) continue;
            const auto time = [&] {
                return tools::seconds_of(
                    [&] { score.contender->trace(set, answers, contest.threads); });
            };
            double seconds = time();
            // Who follows one that walks the same tree finds it in the cache.
            if (seconds < kLongRun) seconds = time();
            score.seconds.push_back(seconds);
        }
    }
    return scores;
}

}  // namespace packet::bench
