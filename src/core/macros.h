// The library's macros, all of them.
#pragma once

#include <cassert>

// Kernels are only fast, and their objects only hold symbols of their own ISA, if the small
// functions they are made of leave no copy behind.
// By nvcc they are compiled for both sides, so that a device runs the very arithmetic that the
// CPU's tests hold to its word. A device keeps in registers only what no function is called with:
// what a walk holds all the way is inlined there even where that is rarely needed.
#if defined(__CUDACC__)
#define PACKET_INLINE __host__ __device__ __forceinline__
#define PACKET_NOINLINE __host__ __device__ __noinline__
#define PACKET_NOINLINE_ON_CPU PACKET_INLINE
#else
#define PACKET_INLINE [[gnu::always_inline]] inline
#define PACKET_NOINLINE [[gnu::noinline]]
#define PACKET_NOINLINE_ON_CPU PACKET_NOINLINE
#endif

// Misuse of an interface, as opposed to bad data, which throws Error.
#define PACKET_ASSERT(condition) assert(condition)

namespace packet {

/// The same object, of which the compiler forgets what it knows: it reads anew what it would
/// otherwise keep in registers that there are not, saved and restored.
template <class T>
PACKET_INLINE const T& opaque(const T& object) {
    const T* address = &object;
    asm("" : "+r"(address));
    return *address;
}

}  // namespace packet
