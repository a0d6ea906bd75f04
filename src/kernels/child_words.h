// What a walk pushes: the children of a node that were met, in some order, and what it knows of
// them, a word of 64 bits a child. How many are met, and which, is anybody's guess, and to guess
// wrong costs as much as meeting the boxes of some rays. So all eight words are moved, those that
// count to the front.
#pragma once

#include "core/views.h"
#include "kernels/lanes.h"

#include <cstdint>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace packet {

using Ints8 [[gnu::vector_size(32)]] = std::int32_t;

/// Of each pair of lanes that `other` swaps the greater number goes where `greater` is -1.
PACKET_INLINE void exchange(Ints8& numbers, const Ints8& other, const Ints8& greater) {
    const Ints8 least = numbers < other ? numbers : other;
    const Ints8 most = numbers < other ? other : numbers;
    numbers = greater != 0 ? most : least;
}
/// The greatest number first.
///
/// Batcher. Sorting networks and their applications. AFIPS 1968.
PACKET_INLINE void sort_descending(Ints8& a) {
    const Ints8 pairs = {-1, 0, -1, 0, -1, 0, -1, 0}, quarters = {-1, -1, 0, 0, -1, -1, 0, 0},
                halves = {-1, -1, -1, -1, 0, 0, 0, 0};
    exchange(a, __builtin_shufflevector(a, a, 1, 0, 3, 2, 5, 4, 7, 6), pairs);
    exchange(a, __builtin_shufflevector(a, a, 3, 2, 1, 0, 7, 6, 5, 4), quarters);
    exchange(a, __builtin_shufflevector(a, a, 1, 0, 3, 2, 5, 4, 7, 6), pairs);
    exchange(a, __builtin_shufflevector(a, a, 7, 6, 5, 4, 3, 2, 1, 0), halves);
    exchange(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5), quarters);
    exchange(a, __builtin_shufflevector(a, a, 1, 0, 3, 2, 5, 4, 7, 6), pairs);
}

/// The children of a node that are met, from the farthest to the nearest, and where they are
/// entered, or up to 7 ulp before that; behind them the others, of which that is no number. Of
/// children that are entered together the first one is farther.
///
/// Those that are met must be entered at more than -inf, not NaN: else others come before them.
/// Rays' tnear, which load_rays() moves to the least float, sees to that, since max(x, tnear) is
/// tnear where x is NaN; in a beam all planes are numbers.
struct FarToNear {
    Ints8 child;
    float enter[kWideSize];

    template <class Isa>
    PACKET_INLINE FarToNear(const Float<kWideSize, Isa>& enters, Mask<kWideSize, Isa> met) {
        constexpr std::int32_t kLast = kWideSize - 1;
        const Ints8 lane = {0, 1, 2, 3, 4, 5, 6, 7};
        // The last bits of a key tell whose it is.
        select(met, enters, Float<kWideSize, Isa>(-__builtin_huge_valf())).store(enter);
        Ints8 key;
        __builtin_memcpy(&key, enter, sizeof(key));
        reorder(key);
        key = (key & ~kLast) | (kLast - lane);
        sort_descending(key);
        child = kLast - (key & kLast);
        key &= ~kLast;
        reorder(key);
        __builtin_memcpy(enter, &key, sizeof(key));
    }
    PACKET_INLINE void store(std::int32_t (&out)[kWideSize]) const {
        __builtin_memcpy(out, &child, sizeof(child));
    }

private:
    /// Turns the bits of floats into integers in the same order, and back.
    PACKET_INLINE static void reorder(Ints8& bits) { bits ^= (bits >> 31) & 0x7FFFFFFF; }
};

/// A word for each child of a node.
template <class Isa>
class ChildWords {
public:
    /// Those of eight in memory.
    PACKET_INLINE explicit ChildWords(const void* from) {
        __builtin_memcpy(word_, from, sizeof(word_));
    }
    PACKET_INLINE ChildWords(const Int<kWideSize, Isa>& low, const Int<kWideSize, Isa>& high) {
        std::int32_t half[2][kWideSize];
        low.store(half[0]), high.store(half[1]);
        for (int i = 0; i < kWideSize; ++i) {
            word_[i] = static_cast<std::uint32_t>(half[0][i]) |
                       std::uint64_t{static_cast<std::uint32_t>(half[1][i])} << 32;
        }
    }
    /// Those of `children`, as they come. Up to eight words of `to`, whose address is a multiple of
    /// 4, are written.
    PACKET_INLINE void store(std::uint32_t children, void* to) const {
        auto* out = static_cast<Word*>(to);
        for (int i = 0; i < kWideSize; ++i) {
            *out = word_[i];
            out += children >> i & 1u;
        }
    }
    /// All eight, in that order.
    PACKET_INLINE void store(const FarToNear& order, void* to) const {
        std::int32_t child[kWideSize];
        order.store(child);
        auto* const out = static_cast<Word*>(to);
        for (int i = 0; i < kWideSize; ++i) out[i] = word_[child[i]];
    }

private:
    using Word [[gnu::may_alias, gnu::aligned(4)]] = std::uint64_t;
    std::uint64_t word_[kWideSize];
};

#if defined(__AVX2__)

/// For each set of four words the numbers of 32 bits that move them to the front.
struct MovesToFront {
    alignas(32) std::int32_t move[16][8] = {};

    constexpr MovesToFront() {
        for (int set = 0; set < 16; ++set) {
            int to = 0;
            for (int word = 0; word < 4; ++word) {
                if ((set >> word & 1) == 0) continue;
                move[set][to++] = 2 * word;
                move[set][to++] = 2 * word + 1;
            }
        }
    }
};

/// In two registers of four.
template <>
class ChildWords<isa::Avx2> {
public:
    PACKET_INLINE explicit ChildWords(const void* from) {
        __builtin_memcpy(words_, from, sizeof(words_));
    }
    PACKET_INLINE ChildWords(const Int<kWideSize, isa::Avx2>& low,
                             const Int<kWideSize, isa::Avx2>& high) {
        std::int32_t half[2][kWideSize];
        low.store(half[0]), high.store(half[1]);
        Ints8 a, b;
        __builtin_memcpy(&a, half[0], sizeof(a)), __builtin_memcpy(&b, half[1], sizeof(b));
        words_[0] = __builtin_shufflevector(a, b, 0, 8, 1, 9, 2, 10, 3, 11);
        words_[1] = __builtin_shufflevector(a, b, 4, 12, 5, 13, 6, 14, 7, 15);
    }
    PACKET_INLINE void store(std::uint32_t children, void* to) const {
        static constexpr MovesToFront kMoves;
        auto* out = static_cast<char*>(to);
        for (int i = 0; i < 2; ++i) {
            const std::uint32_t set = children >> 4 * i & 15u;
            const __m256i move =
                _mm256_load_si256(reinterpret_cast<const __m256i*>(kMoves.move[set]));
            _mm256_storeu_si256(
                reinterpret_cast<__m256i*>(out),
                _mm256_permutevar8x32_epi32(reinterpret_cast<__m256i>(words_[i]), move));
            out += sizeof(std::uint64_t) * static_cast<unsigned>(__builtin_popcount(set));
        }
    }
    PACKET_INLINE void store(const FarToNear& order, void* to) const {
        std::int32_t child[kWideSize];
        std::uint64_t word[kWideSize];
        order.store(child);
        __builtin_memcpy(word, words_, sizeof(word));
        auto* const out = static_cast<char*>(to);
        for (int i = 0; i < kWideSize; ++i) {
            __builtin_memcpy(out + sizeof(word[0]) * static_cast<unsigned>(i), &word[child[i]],
                             sizeof(word[0]));
        }
    }

private:
    Ints8 words_[2];
};

#endif

#if defined(__AVX512F__)

template <>
class ChildWords<isa::Avx512> {
public:
    PACKET_INLINE explicit ChildWords(const void* from) : words_(_mm512_loadu_si512(from)) {}
    PACKET_INLINE ChildWords(const Int<kWideSize, isa::Avx512>& low,
                             const Int<kWideSize, isa::Avx512>& high)
        : words_(_mm512_or_si512(_mm512_cvtepu32_epi64(low.r[0]),
                                 _mm512_slli_epi64(_mm512_cvtepu32_epi64(high.r[0]), 32))) {}
    PACKET_INLINE void store(std::uint32_t children, void* to) const {
        const auto mask = static_cast<__mmask8>(children);
        _mm512_storeu_si512(to, _mm512_maskz_compress_epi64(mask, words_));
    }
    PACKET_INLINE void store(const FarToNear& order, void* to) const {
        const __m512i child = _mm512_cvtepi32_epi64(reinterpret_cast<__m256i>(order.child));
        _mm512_storeu_si512(to, _mm512_permutexvar_epi64(child, words_));
    }

private:
    __m512i words_;
};

#endif

}  // namespace packet
