// On which side of a line or a plane a point lies, without any rounding error. Coordinates are
// floats, so products of two are exact in double, those of three are the sum of two doubles, and
// neither overflows nor underflows. What is left is the sign of a sum of doubles, which expansions
// yield exactly. They are slow, but needed only where the same expression in double, whose error is
// bounded, is too close to zero.
//
// Shewchuk. Adaptive precision floating-point arithmetic and fast robust geometric predicates.
// Discrete & Computational Geometry 1997.
#pragma once

#include "core/macros.h"

namespace packet {

PACKET_INLINE int sign_of(double a) { return (a > 0.0 ? 1 : 0) - (a < 0.0 ? 1 : 0); }

/// The sign of the sum of `count` <= 48 doubles. The sum so far is kept as an expansion: numbers
/// that do not overlap, smallest first and none zero, so that the last one has the sign of all.
template <class Isa>
[[gnu::noinline]] int sign_of_sum(const double* terms, int count) {
    double expansion[48];
    int size = 0;
    for (int i = 0; i < count; ++i) {
        double sum = terms[i];
        int kept = 0;
        for (int j = 0; j < size; ++j) {
            // a + b = sum + error, exactly (Knuth)
            const double a = sum, b = expansion[j];
            sum = a + b;
            const double b_part = sum - a, a_part = sum - b_part;
            const double error = (a - a_part) + (b - b_part);
            if (error != 0.0) expansion[kept++] = error;
        }
        if (sum != 0.0) expansion[kept++] = sum;
        size = kept;
    }
    return size == 0 ? 0 : sign_of(expansion[size - 1]);
}

template <class Isa>
[[gnu::noinline]] int exact_side_of_line(const float (&p)[2], const float (&q)[2],
                                         const float (&r)[2]) {
    const double px = p[0], py = p[1], qx = q[0], qy = q[1], rx = r[0], ry = r[1];
    const double terms[6] = {qx * ry, -qx * py, -px * ry, -qy * rx, qy * px, py * rx};
    return sign_of_sum<Isa>(terms, 6);
}

/// The sign of (q - p) x (r - p): 1 if r lies to the left of the line from p to q.
template <class Isa>
PACKET_INLINE int side_of_line(const float (&p)[2], const float (&q)[2], const float (&r)[2]) {
    const double left = (double{q[0]} - p[0]) * (double{r[1]} - p[1]);
    const double right = (double{q[1]} - p[1]) * (double{r[0]} - p[0]);
    // (3 + 16 e) e in Shewchuk, e = 2^-53. A bound of zero is right too: both products are exact.
    const double error = 0x4p-53 * (__builtin_fabs(left) + __builtin_fabs(right));
    const double sum = left - right;
    return __builtin_fabs(sum) >= error ? sign_of(sum) : exact_side_of_line<Isa>(p, q, r);
}

/// Appends sign * determinant(a, b, c) as 12 doubles.
PACKET_INLINE double* append_determinant(double* out, double sign, const float (&a)[3],
                                         const float (&b)[3], const float (&c)[3]) {
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double products[2] = {sign * b[j] * c[k], -sign * b[k] * c[j]};
        for (const double product : products) {
            // The product's 48 bits in halves of 26 at most, which times a[i] are exact (Veltkamp).
            const double shifted = product * 0x4000001p0;
            const double high = shifted - (shifted - product);
            *out++ = high * a[i];
            *out++ = (product - high) * a[i];
        }
    }
    return out;
}

template <class Isa>
[[gnu::noinline]] int exact_side_of_plane(const float (&a)[3], const float (&b)[3],
                                          const float (&c)[3], const float (&r)[3]) {
    double terms[48];
    double* end = append_determinant(terms, 1.0, b, c, r);
    end = append_determinant(end, -1.0, a, c, r);
    end = append_determinant(end, 1.0, a, b, r);
    append_determinant(end, -1.0, a, b, c);
    return sign_of_sum<Isa>(terms, 48);
}

/// The sign of (b - a) x (c - a) . (r - a): 1 if r is where a, b, c are seen counterclockwise.
template <class Isa>
PACKET_INLINE int side_of_plane(const float (&a)[3], const float (&b)[3], const float (&c)[3],
                                const float (&r)[3]) {
    double ab[3], ac[3], ar[3], sum = 0.0, magnitude = 0.0;
    for (int i = 0; i < 3; ++i) {
        ab[i] = double{b[i]} - a[i], ac[i] = double{c[i]} - a[i], ar[i] = double{r[i]} - a[i];
    }
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double left = ab[j] * ac[k], right = ab[k] * ac[j];
        sum += (left - right) * ar[i];
        magnitude += (__builtin_fabs(left) + __builtin_fabs(right)) * __builtin_fabs(ar[i]);
    }
    // (7 + 56 e) e in Shewchuk
    const double error = 0x8p-53 * magnitude;
    return __builtin_fabs(sum) >= error ? sign_of(sum) : exact_side_of_plane<Isa>(a, b, c, r);
}

}  // namespace packet
