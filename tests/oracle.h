// The brute-force oracle: the contract of a hit, written out for one ray and one triangle in plain
// floats, over all triangles of all instances. It shares no code with the kernels but the question
// which triangles can never be hit, and which box a mesh has.
#pragma once

#include <packet/packet.h>

#include <cstdint>
#include <span>
#include <vector>

namespace packet::test {

class Oracle {
public:
    /// Copies what it needs. Instances of a scene need not be committed.
    explicit Oracle(const Scene& scene);

    [[nodiscard]] Hit closest(const Ray& ray) const;
    [[nodiscard]] bool any(const Ray& ray) const { return closest(ray).is_hit(); }
    [[nodiscard]] std::vector<Hit> closest(std::span<const Ray> rays) const;

private:
    struct Triangle {
        glm::vec3 v[3];
        std::uint32_t prim_id;
    };
    struct Mesh {
        std::vector<Triangle> triangles;
        Bounds3f bounds;
    };
    struct Placed {
        float object_from_world[3][4];
        std::uint32_t mesh_id;
    };

    std::vector<Mesh> meshes_;
    std::vector<Placed> instances_;
};

}  // namespace packet::test
