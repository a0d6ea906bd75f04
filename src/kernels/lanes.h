// N lanes of floats, integers and truth values, of one instruction set: what kernels compute with.
// N lanes take as many registers as they need (16 lanes: one of AVX-512, two of AVX2, four of SSE).
// Every operation rounds as IEEE 754 says, once, so a lane's bits do not depend on N or the ISA;
// but for multiply_subtract, which says so.
#pragma once

#include "core/macros.h"
#include "kernels/registers.h"

#include <cstdint>

namespace packet {

template <int N, class Isa>
struct LanesOf {
    using Reg = typename RegisterFor<Isa, N>::Type;
    static constexpr int kRegisters = N / Reg::kWidth;
    static_assert(kRegisters * Reg::kWidth == N);
};

/// Truth values. Bit i of bits() is lane i.
template <int N, class Isa>
struct Mask : LanesOf<N, Isa> {
    using Reg = typename LanesOf<N, Isa>::Reg;
    static constexpr int kCount = LanesOf<N, Isa>::kRegisters;
    typename Reg::M r[kCount];

    PACKET_INLINE static Mask from_bits(std::uint32_t bits) {
        Mask out;
        for (int i = 0; i < kCount; ++i) out.r[i] = Reg::from_bits(bits >> i * Reg::kWidth);
        return out;
    }
    PACKET_INLINE std::uint32_t bits() const {
        std::uint32_t out = 0;
        for (int i = 0; i < kCount; ++i) out |= Reg::bits(r[i]) << i * Reg::kWidth;
        return out;
    }

    PACKET_INLINE friend Mask operator&(Mask a, Mask b) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::both(a.r[i], b.r[i]);
        return a;
    }
    PACKET_INLINE friend Mask operator|(Mask a, Mask b) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::either(a.r[i], b.r[i]);
        return a;
    }
    PACKET_INLINE friend Mask operator~(Mask a) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::invert(a.r[i]);
        return a;
    }
};

template <int N, class Isa>
PACKET_INLINE bool any(Mask<N, Isa> m) {
    return m.bits() != 0;
}
template <int N, class Isa>
PACKET_INLINE bool none(Mask<N, Isa> m) {
    return m.bits() == 0;
}
template <int N, class Isa>
PACKET_INLINE int count(Mask<N, Isa> m) {
    return __builtin_popcount(m.bits());
}

/// The number of the lowest bit set; `bits` is not 0. (ffs, since nvcc has no ctz for the device.)
PACKET_INLINE int lowest_bit(std::uint32_t bits) {
    return __builtin_ffs(static_cast<int>(bits)) - 1;
}

/// What Float and Int share: loading, storing, comparing, choosing.
template <class Self, class T, int N, class Isa>
struct LaneValues {
    using Reg = typename LanesOf<N, Isa>::Reg;
    using M = Mask<N, Isa>;
    static constexpr int kCount = LanesOf<N, Isa>::kRegisters;

    PACKET_INLINE static Self load(const T* p) {
        Self out;
        for (int i = 0; i < kCount; ++i) out.r[i] = Reg::load(p + i * Reg::kWidth);
        return out;
    }
    PACKET_INLINE void store(T* p) const {
        for (int i = 0; i < kCount; ++i) Reg::store(p + i * Reg::kWidth, self().r[i]);
    }
    /// Stores the lanes of `m` and leaves the others as they are in memory.
    PACKET_INLINE void store(T* p, M m) const { select(m, self(), load(p)).store(p); }

    PACKET_INLINE friend M operator<(const Self& a, const Self& b) {
        M out;
        for (int i = 0; i < kCount; ++i) out.r[i] = Reg::less(a.r[i], b.r[i]);
        return out;
    }
    PACKET_INLINE friend M operator<=(const Self& a, const Self& b) {
        M out;
        for (int i = 0; i < kCount; ++i) out.r[i] = Reg::less_equal(a.r[i], b.r[i]);
        return out;
    }
    PACKET_INLINE friend M operator==(const Self& a, const Self& b) {
        M out;
        for (int i = 0; i < kCount; ++i) out.r[i] = Reg::equal(a.r[i], b.r[i]);
        return out;
    }
    PACKET_INLINE friend M operator>(const Self& a, const Self& b) { return b < a; }
    PACKET_INLINE friend M operator>=(const Self& a, const Self& b) { return b <= a; }

    /// m ? a : b
    PACKET_INLINE friend Self select(M m, Self a, const Self& b) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::select(m.r[i], a.r[i], b.r[i]);
        return a;
    }

private:
    PACKET_INLINE const Self& self() const { return static_cast<const Self&>(*this); }
};

template <int N, class Isa>
struct Float : LaneValues<Float<N, Isa>, float, N, Isa> {
    using Reg = typename LanesOf<N, Isa>::Reg;
    static constexpr int kCount = LanesOf<N, Isa>::kRegisters;
    typename Reg::F r[kCount];

    Float() = default;
    PACKET_INLINE Float(float a) {
        for (int i = 0; i < kCount; ++i) r[i] = Reg::broadcast(a);
    }

    PACKET_INLINE friend Float operator+(Float a, const Float& b) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::add(a.r[i], b.r[i]);
        return a;
    }
    PACKET_INLINE friend Float operator-(Float a, const Float& b) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::sub(a.r[i], b.r[i]);
        return a;
    }
    PACKET_INLINE friend Float operator*(Float a, const Float& b) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::mul(a.r[i], b.r[i]);
        return a;
    }
    PACKET_INLINE friend Float operator/(Float a, const Float& b) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::div(a.r[i], b.r[i]);
        return a;
    }
    /// a * b - c, rounded once where the ISA has fused multiply-add, else twice: for what bounds an
    /// answer, never for the answer.
    PACKET_INLINE friend Float multiply_subtract(Float a, const Float& b, const Float& c) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::multiply_subtract(a.r[i], b.r[i], c.r[i]);
        return a;
    }
    PACKET_INLINE friend Float abs(Float a) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::abs(a.r[i]);
        return a;
    }
    /// a < b ? a : b, so b where either is NaN.
    PACKET_INLINE friend Float min(Float a, const Float& b) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::min(a.r[i], b.r[i]);
        return a;
    }
    /// a > b ? a : b, so b where either is NaN.
    PACKET_INLINE friend Float max(Float a, const Float& b) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::max(a.r[i], b.r[i]);
        return a;
    }
};

template <int N, class Isa>
struct Int : LaneValues<Int<N, Isa>, std::int32_t, N, Isa> {
    using Reg = typename LanesOf<N, Isa>::Reg;
    static constexpr int kCount = LanesOf<N, Isa>::kRegisters;
    typename Reg::I r[kCount];

    Int() = default;
    PACKET_INLINE Int(std::int32_t a) {
        for (int i = 0; i < kCount; ++i) r[i] = Reg::broadcast(a);
    }

    PACKET_INLINE friend Int operator|(Int a, const Int& b) {
        for (int i = 0; i < kCount; ++i) a.r[i] = Reg::either(a.r[i], b.r[i]);
        return a;
    }
};

/// Of eight numbers in memory the one that each lane of `which` tells, from 0 to 7.
template <int N, class Isa>
PACKET_INLINE Float<N, Isa> pick(const float* eight, const Int<N, Isa>& which) {
    Float<N, Isa> out;
    for (int i = 0; i < which.kCount; ++i) {
        out.r[i] = LanesOf<N, Isa>::Reg::pick(eight, which.r[i]);
    }
    return out;
}
template <int N, class Isa>
PACKET_INLINE Int<N, Isa> pick(const std::int32_t* eight, const Int<N, Isa>& which) {
    Int<N, Isa> out;
    for (int i = 0; i < which.kCount; ++i) {
        out.r[i] = LanesOf<N, Isa>::Reg::pick(eight, which.r[i]);
    }
    return out;
}

/// Three numbers of one ray, one an axis. The fourth lane is of no account.
template <class Isa>
using Axes = Float<4, Isa>;

template <class Isa>
PACKET_INLINE Axes<Isa> axes(float x, float y, float z) {
    Axes<Isa> out;
    if constexpr (Axes<Isa>::kCount == 1) {
        out.r[0] = Axes<Isa>::Reg::set(x, y, z, 0.0f);
    } else {
        out.r[0] = x, out.r[1] = y, out.r[2] = z, out.r[3] = 0.0f;
    }
    return out;
}

/// Which axes come first, second and third.
template <int i0, int i1, int i2, class Isa>
PACKET_INLINE Axes<Isa> permute(const Axes<Isa>& a) {
    Axes<Isa> out;
    if constexpr (Axes<Isa>::kCount == 1) {
        out.r[0] = Axes<Isa>::Reg::template permute<i0, i1, i2>(a.r[0]);
    } else {
        out.r[0] = a.r[i0], out.r[1] = a.r[i1], out.r[2] = a.r[i2], out.r[3] = a.r[3];
    }
    return out;
}
template <class Isa>
PACKET_INLINE Axes<Isa> permute(const Axes<Isa>& a, const AxisOrder& order) {
    Axes<Isa> out;
    if constexpr (Axes<Isa>::kCount == 1) {
        out.r[0] = Axes<Isa>::Reg::permute(a.r[0], order);
    } else {
        for (int i = 0; i < 3; ++i) out.r[i] = a.r[order.axis[i]];
        out.r[3] = a.r[3];
    }
    return out;
}

/// Of the three, which hold.
template <class Isa>
PACKET_INLINE std::uint32_t axis_bits(Mask<4, Isa> m) {
    return m.bits() & 7;
}

/// Lanes of packets that may have as many as suit the CPU: those of its widest register.
template <class Isa>
inline constexpr int kPacketLanes = 8;
template <>
inline constexpr int kPacketLanes<isa::Avx512> = 16;

/// One lane of numbers that lie in memory, where it lies there.
template <class Lanes, class T, int N, class Isa>
PACKET_INLINE const T& lane_of(const LaneValues<Lanes, T, N, Isa>& lanes, int lane) {
    return reinterpret_cast<const T*>(static_cast<const Lanes&>(lanes).r)[lane];
}
template <class Lanes, class T, int N, class Isa>
PACKET_INLINE T& lane_of(LaneValues<Lanes, T, N, Isa>& lanes, int lane) {
    return reinterpret_cast<T*>(static_cast<Lanes&>(lanes).r)[lane];
}

/// Lanes that take several registers, one register of them at a time: what keeps many values alive
/// spills less so.
template <int N, class Isa>
inline constexpr int kPartSize = LanesOf<N, Isa>::Reg::kWidth;

template <int N, class Isa>
PACKET_INLINE Float<kPartSize<N, Isa>, Isa> part(const Float<N, Isa>& lanes, int i) {
    Float<kPartSize<N, Isa>, Isa> out;
    out.r[0] = lanes.r[i];
    return out;
}
template <int N, class Isa>
PACKET_INLINE Int<kPartSize<N, Isa>, Isa> part(const Int<N, Isa>& lanes, int i) {
    Int<kPartSize<N, Isa>, Isa> out;
    out.r[0] = lanes.r[i];
    return out;
}
template <int N, class Isa>
PACKET_INLINE Mask<kPartSize<N, Isa>, Isa> part(const Mask<N, Isa>& lanes, int i) {
    Mask<kPartSize<N, Isa>, Isa> out;
    out.r[0] = lanes.r[i];
    return out;
}

/// The lanes of `m` in register i become those of `values`.
template <class Lanes, int N, class Isa, class Part>
PACKET_INLINE void assign_part(Lanes& lanes, int i, Mask<N, Isa> m, const Part& values) {
    lanes.r[i] = select(m, values, part(lanes, i)).r[0];
}

/// Three floats a lane.
template <int N, class Isa>
struct Float3 {
    Float<N, Isa> x, y, z;
};

}  // namespace packet
