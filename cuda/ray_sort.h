// Puts rays that start close together and go the same way next to each other.
#pragma once

#include "memory.h"

#include <packet/bounds.h>
#include <packet/ray.h>

namespace packet::cuda {

/// The order in which to trace the rays, as RayBatch::order. `world` is where most rays start.
[[nodiscard]] DeviceArray<std::uint32_t> sort_rays(const Ray* rays, std::uint32_t count,
                                                   const Bounds3f& world, cudaStream_t stream);

}  // namespace packet::cuda
