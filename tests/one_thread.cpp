// With threads = 1 building and tracing start no thread, not even one that sleeps. A program of its
// own: in the others something has started threads before.
#include "generate.h"
#include "test_rays.h"

#include <cstdio>
#include <filesystem>
#include <iterator>

static long thread_count() {
    return std::distance(std::filesystem::directory_iterator("/proc/self/task"),
                         std::filesystem::directory_iterator());
}

int main() {
    packet::Scene scene = packet::make_scene(packet::tools::make_terrain(100000, 1));
    packet::BuildOptions build;
    build.threads = 1;
    scene.commit(build);
    const auto rays = packet::test::random_rays(scene.bounds(), 100000, 1);
    std::vector<packet::Hit> hits(rays.size());
    packet::TraceOptions trace;
    trace.threads = 1;
    packet::trace_closest(scene, rays, hits, trace);
    const long alone = thread_count();
    std::printf("%ld thread with threads = 1", alone);
    trace.threads = 0;
    packet::trace_closest(scene, rays, hits, trace);
    std::printf(", %ld with all\n", thread_count());
    return alone == 1 ? 0 : 1;
}
