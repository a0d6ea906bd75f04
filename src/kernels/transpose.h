// Rows of eight numbers to columns and back: how rays and hits, which lie in memory one after the
// other, become lanes. Numbers are moved as bits, so integers may travel as floats.
#pragma once

#include "core/macros.h"

namespace packet {

/// Eight floats, in as many registers as the ISA takes for them: compilers lower shuffles of it.
using Floats8 [[gnu::vector_size(32)]] = float;
using UnalignedFloats8 [[gnu::vector_size(32), gnu::aligned(4), gnu::may_alias]] = float;

/// Numbers in memory as a row. (Passed by address: as values rows would be passed differently with
/// and without AVX.)
PACKET_INLINE const UnalignedFloats8* as_row(const void* numbers) {
    return static_cast<const UnalignedFloats8*>(numbers);
}
PACKET_INLINE UnalignedFloats8* as_row(void* numbers) {
    return static_cast<UnalignedFloats8*>(numbers);
}
/// Stores the first six out of the register: a copy of six would go by the stack.
PACKET_INLINE void store6(void* to, const Floats8& row) {
    using Four [[gnu::vector_size(16), gnu::aligned(4), gnu::may_alias]] = float;
    using Two [[gnu::vector_size(8), gnu::aligned(4), gnu::may_alias]] = float;
    *static_cast<Four*>(to) = __builtin_shufflevector(row, row, 0, 1, 2, 3);
    *reinterpret_cast<Two*>(static_cast<float*>(to) + 4) = __builtin_shufflevector(row, row, 4, 5);
}

/// Transposes 8 x 8 numbers, whose rows begin at `from`. Halves of rows are put together as they
/// are loaded, which takes no shuffle; then what is left are transposes of 4 x 4 in halves of
/// registers.
PACKET_INLINE void transpose(const float* const (&from)[8], Floats8 (&out)[8]) {
    using Half [[gnu::vector_size(16), gnu::aligned(4), gnu::may_alias]] = float;
    for (int column = 0; column < 8; column += 4) {
        Floats8 row[4];  // of i and i + 4: four columns each
        for (int i = 0; i < 4; ++i) {
            const Half a = *reinterpret_cast<const Half*>(from[i] + column);
            const Half b = *reinterpret_cast<const Half*>(from[i + 4] + column);
            row[i] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
        }
        Floats8 pair[4];
        for (int i = 0; i < 4; i += 2) {
            pair[i] = __builtin_shufflevector(row[i], row[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
            pair[i + 1] = __builtin_shufflevector(row[i], row[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
        }
        for (int k = 0; k < 2; ++k) {
            const Floats8 &a = pair[k], &b = pair[k + 2];
            out[column + 2 * k] = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
            out[column + 2 * k + 1] = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
        }
    }
}

/// Stores half of a register's row each.
PACKET_INLINE void store_halves(void* first, void* second, const Floats8& row) {
    using Four [[gnu::vector_size(16), gnu::aligned(4), gnu::may_alias]] = float;
    *static_cast<Four*>(first) = __builtin_shufflevector(row, row, 0, 1, 2, 3);
    *static_cast<Four*>(second) = __builtin_shufflevector(row, row, 4, 5, 6, 7);
}

/// Three pairs of numbers of two rows, and of two others in the upper halves, become these rows:
/// four numbers, four and four.
PACKET_INLINE void join_pairs(const Floats8 (&pair)[3], Floats8* out) {
    out[0] = __builtin_shufflevector(pair[0], pair[1], 0, 1, 8, 9, 4, 5, 12, 13);
    out[1] = __builtin_shufflevector(pair[2], pair[0], 0, 1, 10, 11, 4, 5, 14, 15);
    out[2] = __builtin_shufflevector(pair[1], pair[2], 2, 3, 10, 11, 6, 7, 14, 15);
}
/// Six columns of eight become rows of six that follow each other, four rows and four: what the
/// lower halves of `out` hold, one after the other, and what the upper ones do.
PACKET_INLINE void interleave(const float* const (&from)[6], Floats8 (&out)[6]) {
    Floats8 low[3], high[3];  // pairs of columns, of rows 0, 1, 4, 5 and of 2, 3, 6, 7
    for (int i = 0; i < 3; ++i) {
        const Floats8 a = *as_row(from[2 * i]), b = *as_row(from[2 * i + 1]);
        low[i] = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
        high[i] = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
    }
    join_pairs(low, out);
    join_pairs(high, out + 3);
}

}  // namespace packet
