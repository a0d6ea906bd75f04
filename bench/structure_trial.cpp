#include "structure_trial.h"

#include "contest.h"

#include <fmt/core.h>

#include <timing.h>

#include <stdexcept>

namespace packet::bench {
namespace {

double seconds_to_build(Scene& scene, AccelKind accel, int threads) {
    BuildOptions options;
    options.accel = accel;
    options.threads = threads;
    return tools::seconds_of([&] { scene.commit(options); });
}

/// Counted in a run of its own, for counting costs time.
TraceStats count_work(const Scene& scene, std::span<const Ray> rays) {
    TraceStats stats;
    TraceOptions options;
    options.mode = Mode::kSingle;
    options.stats = &stats;
    std::vector<Hit> hits(rays.size());
    trace_closest(scene, rays, hits, options);
    return stats;
}

}  // namespace

StructureTrial::StructureTrial(const TrialScene& scene, int repeats)
    : camera_(scene.camera, make_scene(scene.mesh).bounds()),
      repeats_(repeats),
      scenes_(accel_names().size(), make_scene(scene.mesh)),
      seconds_by_1_(scenes_.size()),
      seconds_by_2_(scenes_.size()) {
    for (int repeat = 0; repeat < repeats; ++repeat) {
        for (std::size_t i = 0; i < scenes_.size(); ++i) {
            const AccelKind accel = accel_names()[i].kind;
            seconds_by_1_[i].push_back(seconds_to_build(scenes_[i], accel, 1));
            seconds_by_2_[i].push_back(seconds_to_build(scenes_[i], accel, 2));
        }
    }
}

std::vector<RayFigures> StructureTrial::trace(tools::RayKind kind) const {
    const RaySet set = make_ray_set(kind, scenes_.front(), camera_);
    std::vector<Contender> contenders;
    for (std::size_t i = 0; i < scenes_.size(); ++i) {
        contenders.push_back(our_contender(scenes_[i], {Mode::kAuto, accel_names()[i].name}));
    }
    const MeshView mesh = scenes_.front().meshes()[0].view();
    std::vector<RayFigures> out;
    for (const Score& score : hold({1, repeats_}, mesh, set, contenders)) {
        if (score.agreement.different != 0) {
            throw std::runtime_error(fmt::format("{} answers {} of {} {} rays differently",
                                                 score.contender->name, score.agreement.different,
                                                 set.rays.size(), set.name));
        }
        out.push_back({1e-6 * static_cast<double>(set.rays.size()) / score.median_seconds(),
                       count_work(scenes_[out.size()], set.rays)});
    }
    return out;
}

std::vector<StructureFigures> StructureTrial::run() const {
    const std::vector<RayFigures> primary = trace(tools::RayKind::kPrimary);
    const std::vector<RayFigures> diffuse = trace(tools::RayKind::kDiffuse);
    std::vector<StructureFigures> out;
    for (std::size_t i = 0; i < scenes_.size(); ++i) {
        const BuildStats& build = scenes_[i].build_stats();
        const auto triangles = static_cast<double>(scenes_[i].triangle_count());
        out.push_back({accel_names()[i].name, tools::median(seconds_by_1_[i]),
                       tools::median(seconds_by_2_[i]),
                       static_cast<double>(build.bytes) / triangles, build.sah_cost, primary[i],
                       diffuse[i]});
    }
    return out;
}

std::vector<std::vector<float>> StructureTrial::nodes_per_pixel() const {
    const RaySet set = make_ray_set(tools::RayKind::kPrimary, scenes_.front(), camera_);
    std::vector<std::vector<float>> out;
    for (const Scene& scene : scenes_) {
        std::vector<float>& nodes = out.emplace_back();
        for (const Ray& ray : set.rays) {
            nodes.push_back(static_cast<float>(count_work(scene, {&ray, 1}).nodes));
        }
    }
    return out;
}

}  // namespace packet::bench
