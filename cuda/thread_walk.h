// Walks a scene with a ray a thread, for rays that do not cohere. Lanes of a warp still run in
// step, so they take turns in two phases: all go down through nodes until each has found a leaf,
// then all meet triangles. A lane that has its leaf puts it off and goes on speculatively, rather
// than wait.
//
// All lanes of the warp go along, whether they have a ray or not: each vote is of the full warp.
//
// Aila, Laine. Understanding the efficiency of ray traversal on GPUs. HPG 2009.
#pragma once

#include "warp_walk.h"

namespace packet::cuda {

/// Down the top tree, into the mesh, and down its tree.
inline constexpr std::uint32_t kMostEntries = 2 * kMaxDepth + 2;
/// So many of them are in shared memory. A walk is seldom deeper.
inline constexpr std::uint32_t kSharedEntries = 8;

/// The rest, in the thread's local memory: an object of its own, since what is indexed takes all
/// that it is a member of out of the registers.
struct FarEntries {
    float enter[kMostEntries - kSharedEntries];
    std::uint32_t node[kMostEntries - kSharedEntries];
};

/// A thread's stack. Its first entries, where a walk mostly is, lie in shared memory, the others in
/// the thread's local memory.
class ShortStack {
public:
    PACKET_INLINE static constexpr std::uint32_t words(std::uint32_t threads) {
        return 2 * kSharedEntries * threads;
    }
    PACKET_DEVICE explicit ShortStack(FarEntries& far)
        : enter_(0, kSharedEntries * blockDim.x),
          node_(kSharedEntries * blockDim.x, kSharedEntries * blockDim.x),
          far_(far) {}

    PACKET_DEVICE void push(float enter, std::uint32_t node) {
        if (depth_ < kSharedEntries) {
            enter_[place(depth_)] = enter;
            node_[place(depth_)] = node;
        } else {
            far_.enter[depth_ - kSharedEntries] = enter;
            far_.node[depth_ - kSharedEntries] = node;
        }
        ++depth_;
    }
    PACKET_DEVICE std::uint32_t pop(float& enter) {
        --depth_;
        if (depth_ < kSharedEntries) {
            enter = enter_[place(depth_)];
            return node_[place(depth_)];
        }
        enter = far_.enter[depth_ - kSharedEntries];
        return far_.node[depth_ - kSharedEntries];
    }
    PACKET_DEVICE void clear() { depth_ = 0; }
    PACKET_DEVICE bool is_empty() const { return depth_ == 0; }

private:
    /// Neighbouring threads in neighbouring banks.
    PACKET_DEVICE static std::uint32_t place(std::uint32_t entry) {
        return entry * blockDim.x + threadIdx.x;
    }

    SharedArray<float> enter_;
    SharedArray<std::uint32_t> node_;
    std::uint32_t depth_ = 0;
    FarEntries& far_;
};

/// One ray on its way through the scene.
template <Levels levels, Query query, class Stats>
class ThreadWalk {
public:
    PACKET_DEVICE ThreadWalk(const SceneView& scene, const RayBatch& batch, FarEntries& far)
        : scene_(scene), batch_(batch), stack_(far) {}

    /// Without a ray, or done with it.
    PACKET_DEVICE bool is_idle() const { return ray_id_ == kNoRay; }
    /// Goes down and has no leaf yet.
    PACKET_DEVICE bool searches() const { return is_at_inner_node() && leaf_.count == 0; }
    /// Goes down, if only speculatively.
    PACKET_DEVICE bool is_at_inner_node() const { return node_id_ < kLeave && !node_.is_leaf(); }

    PACKET_DEVICE void start(std::uint32_t ray_id) {
        ray_id_ = ray_id;
        const LaneRay ray = load_ray(batch_, ray_id);
        const LaneMask1 active = usable(ray);
        best_.reset(ray.tfar, active);
        stack_.clear();
        leaf_ = {0, 0};
        node_id_ = kDone;
        if (none(active)) return;
        if (levels == Levels::kOneMesh) {
            enter_mesh(scene_.instances[0], ray);
        } else {
            enter_top(ray);
        }
    }

    /// Goes on from an inner node to the child that is entered first.
    PACKET_DEVICE void visit() {
        const Node child0 = load_node(*tree_, node_id_ + 1);
        const Node child1 = load_node(*tree_, node_.link);
        const float enter0 = entry(ray_, child0, best_.t).r[0];
        const float enter1 = entry(ray_, child1, best_.t).r[0];
        const bool first0 = enter0 <= enter1;
        const float near = first0 ? enter0 : enter1, far = first0 ? enter1 : enter0;
        if (!(near <= best_.t.r[0])) {
            pop();
        } else {
            const std::uint32_t id0 = node_id_ + 1, id1 = node_.link;
            if (far <= best_.t.r[0]) stack_.push(far, first0 ? id1 : id0);
            node_id_ = first0 ? id0 : id1;
            node_ = first0 ? Link{child0.link, child0.count} : Link{child1.link, child1.count};
        }
        put_off_leaf();
    }

    /// What the lane does between searches: one leaf, one step from space to space, or its end.
    PACKET_DEVICE void meet(Stats& stats) {
        if (is_idle()) return;
        if (leaf_.count != 0) {
            stats.triangles(leaf_.count);
            meet_triangles();
            leaf_.count = 0;
            if (query == Query::kAny && best_.t.r[0] == kNever) node_id_ = kDone;
            put_off_leaf();
        } else if (levels == Levels::kInstances && node_id_ == kLeave) {
            ++instance_;
            if (instance_ == instance_end_) {
                enter_top_again();
            } else {
                enter_instance();
            }
        } else if (levels == Levels::kInstances && node_id_ < kLeave && node_.is_leaf()) {
            instance_ = node_.link;  // of the top tree
            instance_end_ = node_.link + node_.count;
            enter_instance();
        }
        if (node_id_ == kDone && leaf_.count == 0) {
            store_hit<query>(scene_, batch_, ray_id_, best_);
            ray_id_ = kNoRay;
        }
    }

private:
    // In place of a node's number: go back to the top tree; and nothing is left. Trees have fewer
    // than 2^32 - 2 nodes.
    static constexpr std::uint32_t kLeave = 0xFFFFFFFE, kDone = 0xFFFFFFFF;

    PACKET_DEVICE bool is_in_mesh() const { return levels == Levels::kOneMesh || is_in_mesh_; }

    /// If the node is a leaf of triangles: meets it later and goes on, unless one waits already.
    PACKET_DEVICE void put_off_leaf() {
        if (!is_in_mesh() || node_id_ >= kLeave || !node_.is_leaf() || leaf_.count != 0) return;
        leaf_ = node_;
        pop();
    }

    /// Goes on with the nearest subtree that begins before the best hit.
    PACKET_DEVICE void pop() {
        while (!stack_.is_empty()) {
            float enter;
            node_id_ = stack_.pop(enter);
            if (enter > best_.t.r[0]) continue;
            if (node_id_ != kLeave) node_ = load_link(*tree_, node_id_);
            return;
        }
        node_id_ = kDone;
    }

    PACKET_DEVICE void meet_triangles() {
        const auto& tree = static_cast<const DeviceTree&>(*tree_);
        for (std::uint32_t item = leaf_.link; item < leaf_.link + leaf_.count; ++item) {
            const LoadedTriangle triangle = load_triangle(tree, item);
            const auto hits = meet_triangle(ray_, best_.t, best_.t > Lane(kNever), triangle);
            if (none(hits.hit)) continue;
            take_hit<query>(best_, hits, triangle, instance_id_);
        }
    }

    /// Starts at the root of a tree that is not empty.
    PACKET_DEVICE void enter_tree(const TreeView& tree, const LaneRay& ray) {
        tree_ = &tree;
        prepare_lane(ray_, tree, ray);
        const Node root = load_node(tree, 0);
        node_id_ = 0;
        node_ = {root.link, root.count};
        if (!any(entry(ray_, root, best_.t) <= best_.t)) pop();
    }

    PACKET_DEVICE void enter_top(const LaneRay& ray) {
        is_in_mesh_ = false;
        if (scene_.top.node_count != 0) enter_tree(scene_.top, ray);
    }

    /// Goes on in the top tree, with what is on the stack.
    PACKET_DEVICE void enter_top_again() {
        is_in_mesh_ = false;
        tree_ = &scene_.top;
        prepare_lane(ray_, scene_.top, load_ray(batch_, ray_id_));
        pop();
    }

    PACKET_DEVICE void enter_instance() {
        const InstanceView& instance = scene_.instances[instance_];
        stack_.push(kNever, kLeave);
        node_id_ = kLeave;
        const LaneRay ray = to_object(instance, load_ray(batch_, ray_id_));
        if (instance.tree->is_empty() || none(usable(ray))) {
            pop();
        } else {
            enter_mesh(instance, ray);
        }
    }

    PACKET_DEVICE void enter_mesh(const InstanceView& instance, const LaneRay& ray) {
        if (instance.tree->is_empty()) return;
        instance_id_ = static_cast<std::int32_t>(instance.instance_id);
        best_.enter_instance(instance_id_);
        is_in_mesh_ = true;
        enter_tree(*instance.tree, ray);
        put_off_leaf();
    }

    const SceneView& scene_;
    const RayBatch& batch_;
    const TreeView* tree_ = nullptr;
    std::uint32_t ray_id_ = kNoRay;
    std::uint32_t node_id_ = kDone;
    Link node_ = {0, 0};
    Link leaf_ = {0, 0};                             ///< put off; none if count is 0
    std::uint32_t instance_ = 0, instance_end_ = 0;  ///< of the top tree's leaf
    std::int32_t instance_id_ = 0;
    bool is_in_mesh_ = false;
    PreparedLane ray_;
    BestHit best_;
    ShortStack stack_;
};

}  // namespace packet::cuda
