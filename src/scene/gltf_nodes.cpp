// Khronos Group. glTF 2.0 specification, section 3.5: scenes. 2021.
#include "scene/gltf_nodes.h"

#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat4x4.hpp>

#include <cmath>
#include <limits>

namespace packet::gltf {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

// Converters round the bottom row of a matrix, which should be 0 0 0 1, by about a float's
// precision.
constexpr double kBottomRowTolerance = 1e-5;

template <class Matrix>
bool is_finite(const Matrix& matrix) {
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 3; ++row) {
            if (!std::isfinite(matrix[column][row])) return false;
        }
    }
    return true;
}

std::size_t check_node_id(const Document& document, int node_id, const char* kind,
                          std::size_t owner) {
    const auto id = static_cast<std::size_t>(node_id);
    if (node_id < 0 || id >= document.model.nodes.size()) {
        document.errors.fail(kind, " ", owner, ": refers to node ", node_id, ", but there are ",
                             document.model.nodes.size());
    }
    return id;
}

/// The parent of each node, or kNone. Throws if a node has two.
std::vector<std::size_t> find_parents(const Document& document) {
    const auto& nodes = document.model.nodes;
    std::vector<std::size_t> parents(nodes.size(), kNone);
    for (std::size_t id = 0; id < nodes.size(); ++id) {
        for (const int child_id : nodes[id].children) {
            const std::size_t child = check_node_id(document, child_id, "node", id);
            if (parents[child] != kNone) {
                document.errors.fail("node ", child, ": is a child of node ", parents[child],
                                     " and again of node ", id);
            }
            parents[child] = id;
        }
    }
    return parents;
}

/// Throws if a node is its own ancestor. As nobody has two parents, whatever is not below a node
/// without parent is on a cycle, or below one.
void check_acyclic(const Document& document, const std::vector<std::size_t>& parents) {
    const auto& nodes = document.model.nodes;
    std::vector<bool> is_reached(nodes.size());
    std::vector<std::size_t> stack;
    for (std::size_t id = 0; id < nodes.size(); ++id) {
        if (parents[id] == kNone) stack.push_back(id);
    }
    while (!stack.empty()) {
        const std::size_t id = stack.back();
        stack.pop_back();
        is_reached[id] = true;
        for (const int child : nodes[id].children) stack.push_back(static_cast<std::size_t>(child));
    }
    for (std::size_t id = 0; id < nodes.size(); ++id) {
        if (!is_reached[id]) document.errors.fail("node ", id, ": has a cycle among its ancestors");
    }
}

/// The nodes a scene begins with, in order.
std::vector<std::size_t> find_roots(const Document& document) {
    const std::vector<std::size_t> parents = find_parents(document);
    check_acyclic(document, parents);
    std::vector<std::size_t> roots;
    if (document.model.defaultScene < 0) {
        for (std::size_t id = 0; id < parents.size(); ++id) {
            if (parents[id] == kNone) roots.push_back(id);
        }
        return roots;
    }
    const auto scene_id = static_cast<std::size_t>(document.model.defaultScene);
    if (scene_id >= document.model.scenes.size()) {
        document.errors.fail("scene ", scene_id, ": is the default, but there are ",
                             document.model.scenes.size());
    }
    std::vector<bool> is_root(parents.size());
    for (const int node_id : document.model.scenes[scene_id].nodes) {
        const std::size_t id = check_node_id(document, node_id, "scene", scene_id);
        if (parents[id] != kNone || is_root[id]) {
            document.errors.fail("scene ", scene_id, ": node ", id,
                                 is_root[id] ? " is a root twice" : " is a root, but has a parent");
        }
        is_root[id] = true;
        roots.push_back(id);
    }
    return roots;
}

glm::dmat4 parent_from_node(const Document& document, std::size_t node_id) {
    const tinygltf::Node& node = document.model.nodes[node_id];
    if (!node.matrix.empty()) {
        const glm::dmat4 matrix = glm::make_mat4(node.matrix.data());
        const glm::dvec4 bottom(matrix[0][3], matrix[1][3], matrix[2][3], matrix[3][3] - 1.0);
        if (!(glm::dot(bottom, bottom) <= kBottomRowTolerance * kBottomRowTolerance)) {
            document.errors.fail("node ", node_id, ": the bottom row of its matrix is not 0 0 0 1");
        }
        return matrix;
    }
    glm::dmat4 matrix(1.0);
    if (!node.rotation.empty()) {
        const std::vector<double>& r = node.rotation;
        matrix = glm::mat4_cast(glm::normalize(glm::dquat(r[3], r[0], r[1], r[2])));
    }
    if (!node.translation.empty()) {
        matrix[3] = glm::dvec4(glm::make_vec3(node.translation.data()), 1.0);
    }
    if (!node.scale.empty()) {
        for (int i = 0; i < 3; ++i) matrix[i] *= node.scale[static_cast<std::size_t>(i)];
    }
    return matrix;
}

Placement place_mesh(const Document& document, std::size_t node_id, const glm::dmat4& world) {
    const auto mesh_id = static_cast<std::size_t>(document.model.nodes[node_id].mesh);
    if (mesh_id >= document.model.meshes.size()) {
        document.errors.fail("node ", node_id, ": refers to mesh ", mesh_id, ", but there are ",
                             document.model.meshes.size());
    }
    const glm::mat4x3 world_from_object(world);
    if (!is_finite(world_from_object)) {
        document.errors.fail("node ", node_id, ": its transform overflows a float");
    }
    return {node_id, mesh_id, world_from_object};
}

}  // namespace

std::vector<Placement> place_meshes(const Document& document) {
    struct Visit {
        std::size_t node_id;
        glm::dmat4 world_from_parent;
    };
    std::vector<Visit> stack;
    const std::vector<std::size_t> roots = find_roots(document);
    for (std::size_t i = roots.size(); i-- > 0;) stack.push_back({roots[i], glm::dmat4(1.0)});

    std::vector<Placement> placements;
    while (!stack.empty()) {
        const auto [node_id, world_from_parent] = stack.back();
        stack.pop_back();
        const tinygltf::Node& node = document.model.nodes[node_id];
        const glm::dmat4 world = world_from_parent * parent_from_node(document, node_id);
        if (!is_finite(world)) {
            document.errors.fail("node ", node_id, ": its transform is not finite");
        }
        if (node.mesh >= 0) placements.push_back(place_mesh(document, node_id, world));
        for (std::size_t i = node.children.size(); i-- > 0;) {
            stack.push_back({static_cast<std::size_t>(node.children[i]), world});
        }
    }
    return placements;
}

}  // namespace packet::gltf
