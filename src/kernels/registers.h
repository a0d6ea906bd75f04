// One register of each instruction set: the operations that lanes.h builds lanes from. This is the
// only file that names xsimd's types. It serves xsimd 8 (no way to ask a mask for its bits, other
// names for casts of masks) and xsimd 13 alike by reading masks from the registers themselves.
#pragma once

#include "core/macros.h"
#include "kernels/isa_types.h"

#include <cstdint>

#if defined(__SSE4_2__)
#include <xsimd/xsimd.hpp>
#endif

namespace packet {

/// Which of three numbers come first, second and third, and the bytes of a register that they are.
struct AxisOrder {
    alignas(16) std::uint8_t bytes[16];
    std::int32_t axis[4];  ///< the fourth number stays where it is
};

/// Registers of one lane, for any CPU. Written out, since this is what "the same bits" is held to.
template <class Isa>
struct ScalarRegister {
    static constexpr int kWidth = 1;
    using F = float;
    using I = std::int32_t;
    using M = bool;

    PACKET_INLINE static F load(const float* p) { return *p; }
    PACKET_INLINE static I load(const std::int32_t* p) { return *p; }
    PACKET_INLINE static void store(float* p, F a) { *p = a; }
    PACKET_INLINE static void store(std::int32_t* p, I a) { *p = a; }
    PACKET_INLINE static F broadcast(float a) { return a; }
    PACKET_INLINE static I broadcast(std::int32_t a) { return a; }
    PACKET_INLINE static F add(F a, F b) { return a + b; }
    PACKET_INLINE static F sub(F a, F b) { return a - b; }
    PACKET_INLINE static F mul(F a, F b) { return a * b; }
    PACKET_INLINE static F div(F a, F b) { return a / b; }
    PACKET_INLINE static F multiply_subtract(F a, F b, F c) { return a * b - c; }
    PACKET_INLINE static F abs(F a) { return __builtin_fabsf(a); }
    PACKET_INLINE static F min(F a, F b) { return a < b ? a : b; }
    PACKET_INLINE static F max(F a, F b) { return a > b ? a : b; }
    template <class T>
    PACKET_INLINE static M less(T a, T b) {
        return a < b;
    }
    template <class T>
    PACKET_INLINE static M less_equal(T a, T b) {
        return a <= b;
    }
    template <class T>
    PACKET_INLINE static M equal(T a, T b) {
        return a == b;
    }
    PACKET_INLINE static M both(M a, M b) { return a && b; }
    PACKET_INLINE static M either(M a, M b) { return a || b; }
    PACKET_INLINE static M invert(M a) { return !a; }
    PACKET_INLINE static I either(I a, I b) { return a | b; }
    template <class T>
    PACKET_INLINE static T select(M m, T a, T b) {
        return m ? a : b;
    }
    template <class T>
    PACKET_INLINE static T pick(const T* eight, I which) {
        return eight[which];
    }
    PACKET_INLINE static std::uint32_t bits(M m) { return m ? 1u : 0u; }
    PACKET_INLINE static M from_bits(std::uint32_t bits) { return (bits & 1u) != 0; }
};

#if defined(__SSE4_2__)

PACKET_INLINE std::uint32_t mask_bits(__m128 m) {
    return static_cast<std::uint32_t>(_mm_movemask_ps(m));
}
PACKET_INLINE __m128 as_float_mask(__m128i m) { return _mm_castsi128_ps(m); }
PACKET_INLINE __m128i as_int_mask(__m128 m) { return _mm_castps_si128(m); }
#if defined(__AVX2__)
PACKET_INLINE std::uint32_t mask_bits(__m256 m) {
    return static_cast<std::uint32_t>(_mm256_movemask_ps(m));
}
PACKET_INLINE __m256 as_float_mask(__m256i m) { return _mm256_castsi256_ps(m); }
PACKET_INLINE __m256i as_int_mask(__m256 m) { return _mm256_castps_si256(m); }
#endif
#if defined(__AVX512F__)
PACKET_INLINE std::uint32_t mask_bits(__mmask16 m) { return m; }
PACKET_INLINE __mmask16 as_float_mask(__mmask16 m) { return m; }
PACKET_INLINE __mmask16 as_int_mask(__mmask16 m) { return m; }
#endif

/// Of eight numbers in memory the one that each lane of `which` tells.
PACKET_INLINE __m128i pick_lanes(const std::int32_t* eight, __m128i which) {
    const auto* halves = reinterpret_cast<const __m128i*>(eight);
    const __m128i first_bytes = _mm_setr_epi8(0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12);
    const __m128i bytes = _mm_add_epi8(_mm_shuffle_epi8(_mm_slli_epi32(which, 2), first_bytes),
                                       _mm_set1_epi32(0x03020100));
    // Either half is asked for all of them: of a byte's number the shuffle looks at the last bits.
    return _mm_blendv_epi8(_mm_shuffle_epi8(_mm_loadu_si128(halves), bytes),
                           _mm_shuffle_epi8(_mm_loadu_si128(halves + 1), bytes),
                           _mm_cmpgt_epi32(which, _mm_set1_epi32(3)));
}
PACKET_INLINE __m128 pick_lanes(const float* eight, __m128i which) {
    return _mm_castsi128_ps(pick_lanes(reinterpret_cast<const std::int32_t*>(eight), which));
}
#if defined(__AVX2__)
PACKET_INLINE __m256i pick_lanes(const std::int32_t* eight, __m256i which) {
    const auto* all = reinterpret_cast<const __m256i*>(eight);
    return _mm256_permutevar8x32_epi32(_mm256_loadu_si256(all), which);
}
PACKET_INLINE __m256 pick_lanes(const float* eight, __m256i which) {
    return _mm256_permutevar8x32_ps(_mm256_loadu_ps(eight), which);
}
#endif
#if defined(__AVX512F__)
PACKET_INLINE __m512i pick_lanes(const std::int32_t* eight, __m512i which) {
    const auto* all = reinterpret_cast<const __m256i*>(eight);
    return _mm512_permutexvar_epi32(which, _mm512_castsi256_si512(_mm256_loadu_si256(all)));
}
PACKET_INLINE __m512 pick_lanes(const float* eight, __m512i which) {
    return _mm512_permutexvar_ps(which, _mm512_castps256_ps512(_mm256_loadu_ps(eight)));
}
#endif

/// Registers of xsimd's architecture `Arch`. A mask is one of floats; masks of integers are recast.
template <class Arch>
struct XsimdRegister {
    using F = xsimd::batch<float, Arch>;
    using I = xsimd::batch<std::int32_t, Arch>;
    using M = xsimd::batch_bool<float, Arch>;
    using IntMask = xsimd::batch_bool<std::int32_t, Arch>;
    static constexpr int kWidth = static_cast<int>(F::size);

    PACKET_INLINE static M recast(IntMask m) { return M(as_float_mask(m.data)); }
    PACKET_INLINE static IntMask recast(M m) { return IntMask(as_int_mask(m.data)); }

    PACKET_INLINE static F load(const float* p) { return F::load_unaligned(p); }
    PACKET_INLINE static I load(const std::int32_t* p) { return I::load_unaligned(p); }
    PACKET_INLINE static void store(float* p, F a) { a.store_unaligned(p); }
    PACKET_INLINE static void store(std::int32_t* p, I a) { a.store_unaligned(p); }
    PACKET_INLINE static F broadcast(float a) { return F(a); }
    PACKET_INLINE static I broadcast(std::int32_t a) { return I(a); }
    PACKET_INLINE static F add(F a, F b) { return a + b; }
    PACKET_INLINE static F sub(F a, F b) { return a - b; }
    PACKET_INLINE static F mul(F a, F b) { return a * b; }
    PACKET_INLINE static F div(F a, F b) { return a / b; }
    /// a * b - c, fused where the CPU can. (xsimd 8 does not fuse it for AVX-512.)
    PACKET_INLINE static F multiply_subtract(F a, F b, F c) {
#if defined(__AVX512F__)
        if constexpr (kWidth == 16) return F(_mm512_fmsub_ps(a, b, c));
#endif
        return xsimd::fms(a, b, c);
    }
    PACKET_INLINE static F abs(F a) { return xsimd::abs(a); }
    PACKET_INLINE static F min(F a, F b) { return xsimd::min(a, b); }
    PACKET_INLINE static F max(F a, F b) { return xsimd::max(a, b); }
    PACKET_INLINE static M less(F a, F b) { return a < b; }
    PACKET_INLINE static M less_equal(F a, F b) { return a <= b; }
    PACKET_INLINE static M equal(F a, F b) { return a == b; }
    PACKET_INLINE static M less(I a, I b) { return recast(a < b); }
    PACKET_INLINE static M less_equal(I a, I b) { return recast(a <= b); }
    PACKET_INLINE static M equal(I a, I b) { return recast(a == b); }
    PACKET_INLINE static M both(M a, M b) { return a & b; }
    PACKET_INLINE static M either(M a, M b) { return a | b; }
    PACKET_INLINE static M invert(M a) { return ~a; }
    PACKET_INLINE static I either(I a, I b) { return a | b; }
    PACKET_INLINE static F select(M m, F a, F b) { return xsimd::select(m, a, b); }
    PACKET_INLINE static I select(M m, I a, I b) { return xsimd::select(recast(m), a, b); }
    PACKET_INLINE static F pick(const float* eight, I which) {
        return F(pick_lanes(eight, which.data));
    }
    PACKET_INLINE static I pick(const std::int32_t* eight, I which) {
        return I(pick_lanes(eight, which.data));
    }
    PACKET_INLINE static F set(float a, float b, float c, float d) {
        static_assert(kWidth == 4);
        return F(_mm_setr_ps(a, b, c, d));
    }
    template <int i0, int i1, int i2>
    PACKET_INLINE static F permute(F a) {
        static_assert(kWidth == 4);
        return F(_mm_shuffle_ps(a.data, a.data, i0 | i1 << 2 | i2 << 4 | 3 << 6));
    }
    PACKET_INLINE static F permute(F a, const AxisOrder& order) {
        static_assert(kWidth == 4);
        const auto bytes = _mm_load_si128(reinterpret_cast<const __m128i*>(order.bytes));
        return F(_mm_castsi128_ps(_mm_shuffle_epi8(_mm_castps_si128(a.data), bytes)));
    }
    PACKET_INLINE static std::uint32_t bits(M m) { return mask_bits(m.data); }

    PACKET_INLINE static M from_bits(std::uint32_t bits) {
        if constexpr (requires(typename M::register_type r) { r = std::uint16_t{}; }) {
            return M(static_cast<typename M::register_type>(bits));
        } else {
            constexpr std::int32_t kLaneBit[8] = {1, 2, 4, 8, 16, 32, 64, 128};
            const I lane_bit = load(kLaneBit);
            return equal(I(static_cast<std::int32_t>(bits)) & lane_bit, lane_bit);
        }
    }
};

#endif

#if defined(__AVX512F__)

/// Eight lanes on a CPU that has AVX-512: its masks have registers of their own, so that choosing
/// and comparing takes one step. xsimd 8 knows no such registers.
struct Avx512HalfRegister {
    static constexpr int kWidth = 8;
    using F = __m256;
    using I = __m256i;
    using M = __mmask8;

    PACKET_INLINE static F load(const float* p) { return _mm256_loadu_ps(p); }
    PACKET_INLINE static I load(const std::int32_t* p) {
        return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
    }
    PACKET_INLINE static void store(float* p, F a) { _mm256_storeu_ps(p, a); }
    PACKET_INLINE static void store(std::int32_t* p, I a) {
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), a);
    }
    PACKET_INLINE static F broadcast(float a) { return _mm256_set1_ps(a); }
    PACKET_INLINE static I broadcast(std::int32_t a) { return _mm256_set1_epi32(a); }
    PACKET_INLINE static F add(F a, F b) { return _mm256_add_ps(a, b); }
    PACKET_INLINE static F sub(F a, F b) { return _mm256_sub_ps(a, b); }
    PACKET_INLINE static F mul(F a, F b) { return _mm256_mul_ps(a, b); }
    PACKET_INLINE static F div(F a, F b) { return _mm256_div_ps(a, b); }
    PACKET_INLINE static F multiply_subtract(F a, F b, F c) { return _mm256_fmsub_ps(a, b, c); }
    PACKET_INLINE static F abs(F a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a); }
    PACKET_INLINE static F min(F a, F b) { return _mm256_min_ps(a, b); }
    PACKET_INLINE static F max(F a, F b) { return _mm256_max_ps(a, b); }
    PACKET_INLINE static M less(F a, F b) { return _mm256_cmp_ps_mask(a, b, _CMP_LT_OQ); }
    PACKET_INLINE static M less_equal(F a, F b) { return _mm256_cmp_ps_mask(a, b, _CMP_LE_OQ); }
    PACKET_INLINE static M equal(F a, F b) { return _mm256_cmp_ps_mask(a, b, _CMP_EQ_OQ); }
    PACKET_INLINE static M less(I a, I b) { return _mm256_cmplt_epi32_mask(a, b); }
    PACKET_INLINE static M less_equal(I a, I b) { return _mm256_cmple_epi32_mask(a, b); }
    PACKET_INLINE static M equal(I a, I b) { return _mm256_cmpeq_epi32_mask(a, b); }
    PACKET_INLINE static M both(M a, M b) { return a & b; }
    PACKET_INLINE static M either(M a, M b) { return a | b; }
    PACKET_INLINE static M invert(M a) { return static_cast<M>(~a); }
    PACKET_INLINE static I either(I a, I b) { return _mm256_or_si256(a, b); }
    PACKET_INLINE static F select(M m, F a, F b) { return _mm256_mask_blend_ps(m, b, a); }
    PACKET_INLINE static I select(M m, I a, I b) { return _mm256_mask_blend_epi32(m, b, a); }
    PACKET_INLINE static F pick(const float* eight, I which) { return pick_lanes(eight, which); }
    PACKET_INLINE static I pick(const std::int32_t* eight, I which) {
        return pick_lanes(eight, which);
    }
    PACKET_INLINE static std::uint32_t bits(M m) { return m; }
    PACKET_INLINE static M from_bits(std::uint32_t bits) { return static_cast<M>(bits); }
};

#endif

/// The register that serves N lanes of an ISA best. One lane is a scalar on every CPU.
template <class Isa, int N>
struct RegisterFor {
    using Type = ScalarRegister<Isa>;
};
#if defined(__SSE4_2__)
template <int N>
requires(N >= 4) struct RegisterFor<isa::Sse42, N> {
    using Type = XsimdRegister<xsimd::sse4_2>;
};
#endif
#if defined(__AVX2__)
template <>
struct RegisterFor<isa::Avx2, 4> {
    using Type = XsimdRegister<xsimd::sse4_2>;
};
template <int N>
requires(N >= 8) struct RegisterFor<isa::Avx2, N> {
    using Type = XsimdRegister<xsimd::fma3<xsimd::avx2>>;
};
#endif
#if defined(__AVX512F__)
template <>
struct RegisterFor<isa::Avx512, 4> {
    using Type = XsimdRegister<xsimd::sse4_2>;
};
template <>
struct RegisterFor<isa::Avx512, 8> {
    using Type = Avx512HalfRegister;
};
template <>
struct RegisterFor<isa::Avx512, 16> {
    using Type = XsimdRegister<xsimd::avx512dq>;
};
#endif

}  // namespace packet
