// The example of README.md: it is compiled and run by the tests, and `./dev docs` compares the two.
#include <packet/packet.h>

#include <cstdio>

int main() {
    packet::TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};

    packet::Scene scene = packet::make_scene(mesh);
    scene.commit();

    const packet::Ray ray{.org = {0.25f, 0.25f, -1.0f}, .dir = {0.0f, 0.0f, 1.0f}};
    const packet::Hit hit = packet::trace_closest(scene, ray);
    if (hit.is_hit()) std::printf("triangle %u at t = %g\n", hit.prim_id, hit.t);
}
