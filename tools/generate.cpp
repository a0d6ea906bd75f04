// Generated scenes by name, and the soup.
#include "generate.h"

#include "names.h"
#include "random.h"

#include <packet/error.h>

#include <cmath>
#include <string>

namespace packet::tools {

TriangleMesh make_soup(std::size_t triangle_count, std::uint64_t seed) {
    // The total area does not depend on the count, so a ray meets as many triangles in any soup.
    const float scale = 1.0f / std::sqrt(static_cast<float>(triangle_count));
    Random random(seed);
    TriangleMesh mesh;
    mesh.name = "soup";
    mesh.positions.reserve(3 * triangle_count);
    mesh.triangles.reserve(triangle_count);
    for (std::size_t i = 0; i < triangle_count; ++i) {
        const glm::vec3 center = random.point();
        const float u = random.uniform();
        const float size = scale * (0.5f + 8.0f * u * u * u * u * u * u);  // few are large
        const auto first = static_cast<std::uint32_t>(3 * i);
        for (int corner = 0; corner < 3; ++corner) {
            mesh.positions.push_back(center + size * random.direction());
        }
        mesh.triangles.emplace_back(first, first + 1, first + 2);
    }
    return mesh;
}

TriangleMesh generate(std::string_view kind, std::size_t triangle_count, std::uint64_t seed) {
    const SceneKind& scene = find_name("kind of scene", kind, kSceneKinds);
    if (triangle_count < 1 || triangle_count > kMaxTriangles) {
        throw Error(ErrorCode::kBadValue, "cannot make " + std::to_string(triangle_count) +
                                              " triangles; 1 to " + std::to_string(kMaxTriangles) +
                                              " can be made");
    }
    return scene.make(triangle_count, seed);
}

}  // namespace packet::tools
