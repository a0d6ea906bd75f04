// What a library that was built without CUDA says of devices.
#include <packet/cuda.h>
#include <packet/error.h>

namespace packet::cuda {

struct DeviceScene::Impl {};

[[noreturn]] static void throw_unavailable() {
    throw Error(ErrorCode::kUnsupported,
                "this build of packet has no CUDA: configure it with -DPACKET_CUDA=ON");
}

std::string device_name() { throw_unavailable(); }

DeviceScene::DeviceScene(const Scene&) { throw_unavailable(); }
DeviceScene::DeviceScene(const Scene&, const BuildOptions&) { throw_unavailable(); }
DeviceScene::~DeviceScene() = default;
DeviceScene::DeviceScene(DeviceScene&&) noexcept = default;
DeviceScene& DeviceScene::operator=(DeviceScene&&) noexcept = default;

void DeviceScene::trace_closest(std::span<const Ray>, std::span<Hit>,
                                const DeviceTraceOptions&) const {
    throw_unavailable();
}
void DeviceScene::trace_any(std::span<const Ray>, std::span<std::uint8_t>,
                            const DeviceTraceOptions&) const {
    throw_unavailable();
}

}  // namespace packet::cuda
