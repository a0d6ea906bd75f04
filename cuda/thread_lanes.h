// The instruction set of one CUDA thread: a lane of its own. With it the kernels' own headers,
// their box and triangle tests and the set-up of rays, are compiled for the device as they are, so
// hits are those of the CPU by the same lines of source. What a warp does together is said by
// votes, in the walks.
#pragma once

#include "device.h"
#include "kernels/registers.h"

namespace packet::isa {

struct CudaThread {};

}  // namespace packet::isa

namespace packet {

/// As any scalar, but with a fused multiply-add for what bounds answers and is none. (Products and
/// sums of the answers themselves are kept apart by -fmad=false.)
struct CudaRegister : ScalarRegister<isa::CudaThread> {
    PACKET_INLINE static float multiply_subtract(float a, float b, float c) {
#if defined(__CUDACC__) && !defined(__CUDA_ARCH__)
        return a * b - c;  // the host's copy, which nothing calls
#else
        return __fmaf_rn(a, b, -c);
#endif
    }
};

template <>
struct RegisterFor<isa::CudaThread, 1> {
    using Type = CudaRegister;
};

}  // namespace packet
