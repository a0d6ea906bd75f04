// The table of structures: a new one adds a line to each of the two tables below.
#include "build/bvh_midpoint.h"
#include "build/bvh_morton.h"
#include "build/bvh_sah.h"
#include "build/bvh_spatial.h"
#include "build/grid_of_trees.h"
#include "build/kd_tree.h"
#include "build/octree.h"
#include "build/tree.h"
#include "build/treelets.h"
#include "build/uniform_grid.h"
#include "build/validate_tree.h"
#include "core/macros.h"
#include "core/names.h"

#include <packet/accel.h>
#include <packet/error.h>

#include <array>
#include <chrono>
#include <string>

namespace packet {

static constexpr std::array kAccelNames = {
    AccelName{AccelKind::kBvh, "bvh"},
    AccelName{AccelKind::kBvhMidpoint, "bvh-midpoint"},
    AccelName{AccelKind::kBvhMorton, "bvh-morton"},
    AccelName{AccelKind::kBvhSpatial, "bvh-spatial"},
    AccelName{AccelKind::kKdMidpoint, "kd-midpoint"},
    AccelName{AccelKind::kKdMedian, "kd-median"},
    AccelName{AccelKind::kKdSah, "kd-sah"},
    AccelName{AccelKind::kOctree, "octree"},
    AccelName{AccelKind::kGrid, "grid"},
    AccelName{AccelKind::kGridOfTrees, "grid-of-trees"},
};

std::span<const AccelName> accel_names() noexcept { return kAccelNames; }

std::string_view to_string(AccelKind kind) noexcept {
    for (const AccelName& entry : kAccelNames) {
        if (entry.kind == kind) return entry.name;
    }
    return "?";
}

AccelKind parse_accel(std::string_view name) {
    return find_by_name(kAccelNames, name, "structure").kind;
}

static constexpr std::array kQualityNames = {
    QualityName{BuildQuality::kFast, "fast"},
    QualityName{BuildQuality::kBalanced, "balanced"},
    QualityName{BuildQuality::kHigh, "high"},
};

std::span<const QualityName> quality_names() noexcept { return kQualityNames; }

std::string_view to_string(BuildQuality quality) noexcept {
    for (const QualityName& entry : kQualityNames) {
        if (entry.quality == quality) return entry.name;
    }
    return "?";
}

BuildQuality parse_quality(std::string_view name) {
    return find_by_name(kQualityNames, name, "quality").quality;
}

AccelKind chosen_accel(const BuildOptions& options) {
    if (options.quality == BuildQuality::kBalanced) return options.accel;
    if (options.accel != AccelKind::kBvh) {
        throw Error(ErrorCode::kUnsupported, "quality '" + std::string(to_string(options.quality)) +
                                                 "' chooses how bvh is built; there is none of " +
                                                 std::string(to_string(options.accel)));
    }
    return options.quality == BuildQuality::kFast ? AccelKind::kBvhMorton : AccelKind::kBvhSpatial;
}

static constexpr std::array kKdBuildNames = {
    KdBuildName{KdBuild::kSorted, "sorted"},
    KdBuildName{KdBuild::kBreadthFirst, "breadth-first"},
};

std::span<const KdBuildName> kd_build_names() noexcept { return kKdBuildNames; }

KdBuild parse_kd_build(std::string_view name) {
    return find_by_name(kKdBuildNames, name, "way to build a k-d tree").build;
}

/// `tree(hierarchy)` makes a tree of what most builders hand on.
template <class MakeTree>
static Tree build(AccelKind kind, MeshView mesh, ScratchVector<Reference> references,
                  const BuildOptions& options, const Parallel& parallel, const MakeTree& tree) {
    const auto kd_tree = [&](KdRule rule) {
        return tree(build_kd_tree(rule, mesh, std::move(references), options, parallel));
    };
    switch (kind) {
        case AccelKind::kBvh: return tree(build_bvh_sah(std::move(references), options, parallel));
        case AccelKind::kKdMidpoint: return kd_tree(KdRule::kMidpoint);
        case AccelKind::kKdMedian: return kd_tree(KdRule::kMedian);
        case AccelKind::kKdSah: return kd_tree(KdRule::kSah);
        case AccelKind::kOctree:
            return tree(build_octree(mesh, std::move(references), options, parallel));
        case AccelKind::kBvhMidpoint:
            return tree(build_bvh_midpoint(std::move(references), options, parallel));
        case AccelKind::kBvhMorton:
            return tree(build_bvh_morton(std::move(references), options, parallel));
        case AccelKind::kBvhSpatial:
            return tree(build_bvh_spatial(mesh, std::move(references), options, parallel));
        case AccelKind::kGrid: return build_uniform_grid(mesh, references, options, parallel);
        case AccelKind::kGridOfTrees:
            return build_grid_of_trees(mesh, references, options, parallel);
    }
    PACKET_ASSERT(false && "an AccelKind that is not in the enumeration");
    return {};
}

Tree build_tree(MeshView mesh, const BuildOptions& options) {
    return with_progress(options.progress, "the build", [&](Progress& progress) {
        return build_tree(mesh, options, progress, 1.0);
    });
}

// Of a build's time, about; what making a tree of the hierarchy takes is the rest.
static constexpr double kShareOfReferences = 0.05, kShareOfHierarchy = 0.75;

Tree build_tree(MeshView mesh, const BuildOptions& options, Progress& progress, double share) {
    const auto start = std::chrono::steady_clock::now();
    validate(mesh);
    validate(options);
    const AccelKind kind = chosen_accel(options);
    const Parallel parallel(options.threads, progress);
    progress.start_phase(kShareOfReferences * share);
    References references;
    parallel.run([&] { references = collect_references(mesh, parallel); });
    const SkippedTriangles skipped = references.skipped;
    progress.start_phase(kShareOfHierarchy * share);
    const auto finish = [&](const Hierarchy& hierarchy) {
        progress.start_phase((1.0 - kShareOfReferences - kShareOfHierarchy) * share);
        return make_tree(hierarchy, mesh, options, parallel);
    };
    Tree tree = build(kind, mesh, std::move(references.items), options, parallel, finish);
    cut_into_treelets(tree, kind, options, parallel);
    tree.stats.skipped = skipped;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    tree.stats.seconds = elapsed.count();
    PACKET_ASSERT((validate(tree, mesh, kind), true));  // throws, and says what is wrong
    return tree;
}

}  // namespace packet
