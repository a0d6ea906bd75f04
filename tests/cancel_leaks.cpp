// Fails if a cancelled build keeps memory. A program of its own: it counts all allocations.
#include "generate.h"

#include <packet/error.h>
#include <packet/scene.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <new>

static std::atomic<long> live_count = 0;

static void* allocate(std::size_t bytes, std::size_t alignment) {
    ++live_count;
    const std::size_t rounded = (bytes + alignment - 1) / alignment * alignment;
    if (void* memory = std::aligned_alloc(alignment, rounded)) return memory;
    throw std::bad_alloc();
}

static void deallocate(void* memory) noexcept {
    if (memory != nullptr) --live_count;
    std::free(memory);  // NOLINT(cppcoreguidelines-no-malloc): this is what RAII stands on
}

void* operator new(std::size_t bytes) { return allocate(bytes, alignof(std::max_align_t)); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
    return allocate(bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { deallocate(memory); }
void operator delete(void* memory, std::size_t) noexcept { deallocate(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { deallocate(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { deallocate(memory); }

namespace {

/// Cancels builds at every report, until one gets through. Yields how many were cancelled.
int cancel_everywhere(packet::Scene& scene, packet::BuildOptions options) {
    for (int last = 0;; ++last) {
        int number = 0;
        options.progress = [&](float) { return number++ != last; };
        try {
            packet::Scene(scene).commit(options);
            return last;
        } catch (const packet::Error&) {
        }
    }
}

}  // namespace

int main() {
    packet::Scene scene = packet::make_scene(packet::tools::make_city(12000, 1));
    int status = 0;
    for (const packet::AccelName& accel : packet::accel_names()) {
        for (const int threads : {1, 2}) {
            packet::BuildOptions options;
            options.accel = accel.kind;
            options.threads = threads;
            packet::Scene(scene).commit(options);  // what threads set up once stays
            const long before = live_count;
            const int cancelled = cancel_everywhere(scene, options);
            const long kept = live_count - before;
            if (kept == 0 && cancelled > 8) continue;
            std::printf("%s on %d threads: %ld allocations live after %d cancelled builds\n",
                        accel.name.data(), threads, kept, cancelled);
            status = 1;
        }
    }
    return status;
}
