// The kernels that trace, as functions of the host.
#pragma once

#include "ray_batch.h"

namespace packet::cuda {

/// How lanes of a warp go about their rays.
enum class Walk : std::uint8_t {
    kWarp,   ///< 32 rays share one stack: for rays that cohere
    kThread  ///< each on its own
};

enum class Counting : std::uint8_t { kNo, kYes };

/// What is launched: which kernel, and for which scene.
struct TraceLaunch {
    Walk walk;
    Query query;
    Counting counting;
    std::uint32_t stack_depth;  ///< entries that a walk of the scene needs at most
    cudaStream_t stream;
};

/// Traces the batch, later, in the stream. Throws Error{kUnsupported} if the device has too little
/// shared memory for the stack.
void launch_trace(const SceneView& scene, const RayBatch& batch, const TraceLaunch& how);

}  // namespace packet::cuda
