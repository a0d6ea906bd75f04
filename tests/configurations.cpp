#include "configurations.h"

#include "dispatch/dispatch.h"
#include "scene/scene_accel.h"
#include "share.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <iostream>

namespace packet::test {

std::string Configuration::name() const {
    return std::string(to_string(accel)) + " " + std::string(to_string(mode)) + " " +
           std::string(to_string(isa)) + " threads=" + std::to_string(threads);
}

TraceOptions Configuration::trace_options() const {
    TraceOptions options;
    options.mode = mode;
    options.isa = isa;
    options.threads = threads;
    return options;
}

static void report_skipped_isas() {
    static const bool once = [] {
        for (const IsaId isa : built_isas()) {
            if (!cpu_supports(isa))
                std::cout << "skipped: " << to_string(isa) << " (not this CPU)\n";
        }
        return true;
    }();
    (void)once;
}

std::vector<IsaId> cpu_isas() {
    std::vector<IsaId> out;
    for (const IsaId isa : built_isas()) {
        if (cpu_supports(isa)) out.push_back(isa);
    }
    return out;
}

std::vector<Build> all_builds() {
    std::vector<Build> out;
    for (const AccelName& accel : accel_names()) {
        BuildOptions options;
        options.accel = accel.kind;
        options.treelet_bytes = 2000;  // so that small scenes have many
        options.keep_binary_nodes = true;
        if (accel.kind != AccelKind::kKdSah) {
            out.push_back({std::string(accel.name), options});
            continue;
        }
        for (const KdBuildName& way : kd_build_names()) {
            options.kd_build = way.build;
            out.push_back({std::string(accel.name) + " " + std::string(way.name), options});
        }
    }
    return out;
}

std::vector<Configuration> all_configurations(AccelKind accel) {
    report_skipped_isas();
    std::vector<Configuration> out;
    for (const ModeName& mode : mode_names()) {
        for (const IsaId isa : cpu_isas()) out.push_back({accel, mode.mode, isa, 1});
        for (const int threads : {2, 3}) out.push_back({accel, mode.mode, default_isa(), threads});
    }
    return out;
}

std::size_t count_differences(std::span<const Ray> rays, std::span<const Hit> want,
                              std::span<const Hit> got) {
    std::size_t differences = 0;
    for (std::size_t i = 0; i < want.size(); ++i) {
        if (std::memcmp(&want[i], &got[i], sizeof(Hit)) == 0) continue;
        if (differences++ != 0) continue;
        const Ray& r = rays[i];
        MESSAGE("ray " << i << " org " << r.org.x << " " << r.org.y << " " << r.org.z << " dir "
                       << r.dir.x << " " << r.dir.y << " " << r.dir.z << " [" << r.tnear << ", "
                       << r.tfar << "]: want t " << want[i].t << " prim " << want[i].prim_id
                       << " instance " << want[i].instance_id << ", got t " << got[i].t << " prim "
                       << got[i].prim_id << " instance " << got[i].instance_id);
    }
    return differences;
}

static void check_configuration(const Scene& scene, std::span<const Ray> rays,
                                std::span<const Hit> want, const Configuration& configuration) {
    INFO(configuration.name());
    std::vector<Hit> hits(rays.size());
    trace_closest(scene, rays, hits, configuration.trace_options());
    CHECK(count_differences(rays, want, hits) == 0);

    std::vector<std::uint8_t> occluded(rays.size(), 7);
    trace_any(scene, rays, occluded, configuration.trace_options());
    std::size_t different = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) different += occluded[i] != want[i].is_hit();
    CHECK(different == 0);
}

/// Rays by a call each, which takes kernels of its own.
static void check_calls(const Scene& scene, std::span<const Ray> rays, std::span<const Hit> want,
                        IsaId isa) {
    INFO("a call a ray, " << to_string(isa));
    const KernelTable& kernels = select_kernels(isa);
    std::vector<Hit> hits(rays.size());
    std::size_t different = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        kernels.closest_ray(scene.accel().view, rays[i], hits[i]);
        different += kernels.any_ray(scene.accel().view, rays[i]) != want[i].is_hit();
    }
    CHECK(count_differences(rays, want, hits) == 0);
    CHECK(different == 0);
}

namespace {

/// A share of the rays for each configuration, so that together the configurations trace all. It is
/// enough for a beam around a tile, or for several tasks if there are threads to share them.
class Shares {
public:
    explicit Shares(std::size_t all) : all_(all) {}

    struct Range {
        std::size_t first, count;
    };
    Range next(int threads) {
        constexpr std::size_t kLeast = 128, kLeastForTasks = 1100;
        const std::size_t count = share_of(all_, threads == 1 ? kLeast : kLeastForTasks);
        if (begin_ >= all_) begin_ = 0;
        const std::size_t first = std::min(begin_, all_ - count);
        begin_ = first + count;
        return {first, count};
    }

private:
    std::size_t all_, begin_ = 0;
};

}  // namespace

void check_agreement(Scene scene, std::span<const Ray> rays, const std::string& label) {
    INFO(label);
    const std::vector<Hit> want = Oracle(scene).closest(rays);
    Shares shares(rays.size());
    for (const Build& build : all_builds()) {
        INFO(build.name);
        scene.commit(build.options);
        for (const Configuration& configuration : all_configurations(build.options.accel)) {
            const auto [first, count] = shares.next(configuration.threads);
            check_configuration(scene, rays.subspan(first, count),
                                std::span(want).subspan(first, count), configuration);
        }
        for (const IsaId isa : cpu_isas()) {
            const auto [first, count] = shares.next(1);
            check_calls(scene, rays.subspan(first, count), std::span(want).subspan(first, count),
                        isa);
        }
    }
}

}  // namespace packet::test
