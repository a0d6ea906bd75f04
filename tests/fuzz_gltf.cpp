// Feeds arbitrary bytes to the glTF loader. Anything but a scene or an Error is a bug: a crash, a
// hang, another exception, more memory than the file's size allows.
#include "scene/gltf_load.h"

#include <packet/error.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        // No buffer can be read from a folder that is not there.
        const packet::GltfScene loaded =
            packet::load_gltf(std::as_bytes(std::span(data, size)), "/nonexistent/fuzz.gltf");
        for (const packet::Instance& instance : loaded.scene.instances()) {
            if (instance.mesh_id >= loaded.scene.meshes().size()) std::abort();
        }
    } catch (const packet::Error&) {
    }
    return 0;
}
