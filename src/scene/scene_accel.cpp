#include "scene/scene_accel.h"

#include "build/bvh_sah.h"
#include "scene/transform.h"

#include <packet/error.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>

namespace packet {

namespace {

void add_stats(BuildStats& sum, const BuildStats& tree) {
    sum.bytes += tree.bytes;
    sum.node_count += tree.node_count;
    sum.leaf_count += tree.leaf_count;
    sum.depth = std::max(sum.depth, tree.depth);
    sum.skipped.non_finite += tree.skipped.non_finite;
    sum.skipped.too_large += tree.skipped.too_large;
    sum.skipped.zero_area += tree.skipped.zero_area;
    sum.treelets.count += tree.treelets.count;
    sum.treelets.bytes += tree.treelets.bytes;
    sum.treelets.cut_edges += tree.treelets.cut_edges;
    sum.treelets.most_bytes = std::max(sum.treelets.most_bytes, tree.treelets.most_bytes);
    sum.treelets.expected_entries =
        std::max(sum.treelets.expected_entries, tree.treelets.expected_entries);
}

/// `share_of_one`: how much of the work a triangle is.
void build_trees(std::span<const TriangleMesh> meshes, const BuildOptions& options,
                 Progress& progress, double share_of_one, SceneAccel& out) {
    std::size_t most_triangles = 0;
    for (const TriangleMesh& mesh : meshes) {
        const double share = share_of_one * static_cast<double>(mesh.triangles.size());
        out.trees.push_back(build_tree(mesh.view(), options, progress, share));
        add_stats(out.stats, out.trees.back().stats);
        if (mesh.triangles.size() < most_triangles) continue;
        most_triangles = mesh.triangles.size();
        out.stats.sah_cost = out.trees.back().stats.sah_cost;
    }
    for (const Tree& tree : out.trees) out.tree_views.push_back(tree.view());
}

/// What rounding in the transform of a ray comes to, for the worst instance: ray and inverse are
/// rounded in float, and the inverse magnifies that by its condition. The errors scale with the
/// numbers that are added up: origin, translation and corners. 4 roundings a component of the
/// origin, 3 of the direction, 2 of the matrix, and the 8 ulp of the mesh's own boxes: 32 bounds
/// their sum amply.
struct TransformError {
    float condition = 1.0f;
    float largest_translation = 0.0f;

    void extend(const ObjectFromWorld& inverse, const glm::mat4x3& transform) {
        condition = std::max(condition, inverse.condition);
        for (int a = 0; a < 3; ++a) {
            largest_translation = std::max(largest_translation, std::abs(transform[3][a]));
        }
    }
    void apply(TreeView& top) const {
        top.slack = 32.0f / 16777216.0f * condition;
        top.reach = largest_translation;
        for (int a = 0; a < 3; ++a) {
            top.reach = std::max({top.reach, std::abs(top.lower[a]), std::abs(top.upper[a])});
        }
        top.reach *= 2.0f;
    }
};

}  // namespace

void build_top(std::span<const Instance> instances, std::span<const Bounds3f> mesh_bounds,
               const BuildOptions& options, const Parallel& parallel, SceneAccel& out) {
    ScratchVector<Reference> references;
    std::vector<InstanceView> views(instances.size());
    TransformError error;
    for (std::size_t i = 0; i < instances.size(); ++i) {
        const auto id = static_cast<std::uint32_t>(i);
        const Instance& instance = instances[i];
        const std::string what = "transform of instance " + std::to_string(i);
        const ObjectFromWorld inverse = invert(instance.world_from_object, what.c_str());
        std::copy_n(&inverse.row[0][0], 12, &views[i].object_from_world[0][0]);
        views[i].instance_id = id;
        views[i].tree = nullptr;
        out.mesh_of_instance.push_back(instance.mesh_id);
        const Bounds3f box = transform(instance.world_from_object, mesh_bounds[instance.mesh_id]);
        if (box.empty()) continue;  // it shows nothing
        error.extend(inverse, instance.world_from_object);
        references.push_back({box.lower, id, box.upper});
    }
    BuildOptions top_options = options;
    top_options.max_leaf_size = 1;
    const Hierarchy hierarchy = build_bvh_sah(std::move(references), top_options, parallel);
    out.top = make_tree(hierarchy, top_options, parallel);
    for (const std::uint32_t id : hierarchy.ids) out.instances.push_back(views[id]);
    SceneView& view = out.view;
    view.top = out.top.view();
    error.apply(view.top);
    view.instances = out.instances.data();
    view.instance_count = static_cast<std::uint32_t>(out.instances.size());
    view.mesh_of_instance = out.mesh_of_instance.data();
    view.is_single_mesh = instances.size() == 1 && view.instance_count == 1 &&
                          instances[0].world_from_object == glm::mat4x3(1.0f);
}

static std::shared_ptr<const SceneAccel> build_all(std::span<const TriangleMesh> meshes,
                                                   std::span<const Instance> instances,
                                                   const BuildOptions& options,
                                                   Progress& progress) {
    const auto start = std::chrono::steady_clock::now();
    const auto out = std::make_shared<SceneAccel>();
    std::size_t work = instances.size();
    for (const TriangleMesh& mesh : meshes) work += mesh.triangles.size();
    const double share_of_one = 1.0 / static_cast<double>(std::max<std::size_t>(work, 1));
    build_trees(meshes, options, progress, share_of_one, *out);
    progress.start_phase(share_of_one * static_cast<double>(instances.size()));
    std::vector<Bounds3f> boxes;
    for (const Tree& tree : out->trees) boxes.push_back(tree.bounds);
    build_top(instances, boxes, options, Parallel(options.threads, progress), *out);
    for (InstanceView& instance : out->instances) {
        instance.tree = &out->tree_views[out->mesh_of_instance[instance.instance_id]];
    }
    out->stats.bytes += out->top.stats.bytes + out->instances.size() * sizeof(InstanceView) +
                        out->mesh_of_instance.size() * sizeof(std::uint32_t);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    out->stats.seconds = elapsed.count();
    return out;
}

std::shared_ptr<const SceneAccel> build_scene_accel(std::span<const TriangleMesh> meshes,
                                                    std::span<const Instance> instances,
                                                    const BuildOptions& options) {
    return with_progress(options.progress, "the build", [&](Progress& progress) {
        std::shared_ptr<const SceneAccel> out;
        // One arena for all that is built: its threads stay awake.
        Parallel(options.threads).run([&] {
            out = build_all(meshes, instances, options, progress);
        });
        return out;
    });
}

}  // namespace packet
