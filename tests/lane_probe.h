// Runs every operation of lanes.h and child_words.h once, for one instruction set. Compiled per
// instruction set, as the kernels are; lanes_test.cpp compares what comes out with plain scalar
// code.
#pragma once

#include "kernels/child_words.h"
#include "kernels/lanes.h"

#include <cstdint>

namespace packet::test {

inline constexpr int kMostLanes = 16;

struct LaneInput {
    float a[kMostLanes], b[kMostLanes];
    std::int32_t i[kMostLanes], j[kMostLanes];
    std::int32_t which[kMostLanes];  ///< from 0 to 7
    std::uint32_t bits;
};

struct LaneOutput {
    float add[kMostLanes], sub[kMostLanes], mul[kMostLanes], div[kMostLanes];
    float abs[kMostLanes], min[kMostLanes], max[kMostLanes], select[kMostLanes];
    float broadcast[kMostLanes], masked_store[kMostLanes], picked[kMostLanes];
    std::int32_t int_select[kMostLanes], int_broadcast[kMostLanes], int_masked_store[kMostLanes];
    std::int32_t int_picked[kMostLanes];
    std::uint32_t less, less_equal, greater, greater_equal, equal;
    std::uint32_t int_less, int_less_equal, int_equal, both, either, invert, from_bits;
    std::uint32_t any, none, count;
};

/// Children of a node, and how those of `met` are pushed: as they come, and by where they are
/// entered.
struct ChildInput {
    float enter[kWideSize];
    std::uint64_t word[kWideSize];
    std::int32_t low[kWideSize], high[kWideSize];
    std::uint32_t met;
};
struct ChildOutput {
    std::uint64_t some[kWideSize + 1], some_joined[kWideSize + 1];
    std::uint64_t ordered[kWideSize + 1], ordered_joined[kWideSize + 1];
    std::int32_t child[kWideSize];
    float enter[kWideSize];
};

using ChildProbe = void (*)(const ChildInput&, ChildOutput&);
using LaneProbe = void (*)(const LaneInput&, LaneOutput&);
struct LaneProbes {
    LaneProbe lanes1, lanes8, lanes16;
    ChildProbe children;
};

LaneProbes lane_probes_scalar();
LaneProbes lane_probes_sse42();
LaneProbes lane_probes_avx2();
LaneProbes lane_probes_avx512();

template <int N, class Isa>
void probe_lanes(const LaneInput& in, LaneOutput& out) {
    using F = Float<N, Isa>;
    using I = Int<N, Isa>;
    using M = Mask<N, Isa>;
    const F a = F::load(in.a), b = F::load(in.b);
    const I i = I::load(in.i), j = I::load(in.j);
    const M m = M::from_bits(in.bits);
    (a + b).store(out.add), (a - b).store(out.sub), (a * b).store(out.mul), (a / b).store(out.div);
    abs(a).store(out.abs), min(a, b).store(out.min), max(a, b).store(out.max);
    select(m, a, b).store(out.select), F(in.a[0]).store(out.broadcast);
    b.store(out.masked_store), a.store(out.masked_store, m);
    select(m, i, j).store(out.int_select), I(in.i[0]).store(out.int_broadcast);
    j.store(out.int_masked_store), i.store(out.int_masked_store, m);
    const I which = I::load(in.which);
    pick(in.a, which).store(out.picked), pick(in.i, which).store(out.int_picked);
    out.less = (a < b).bits(), out.less_equal = (a <= b).bits(), out.equal = (a == b).bits();
    out.greater = (a > b).bits(), out.greater_equal = (a >= b).bits();
    out.int_less = (i < j).bits(), out.int_less_equal = (i <= j).bits();
    out.int_equal = (i == j).bits();
    out.both = ((a < b) & m).bits(), out.either = ((a < b) | m).bits(), out.invert = (~m).bits();
    out.from_bits = m.bits();
    out.any = any(m), out.none = none(m), out.count = static_cast<std::uint32_t>(count(m));
}

template <class Isa>
void probe_children(const ChildInput& in, ChildOutput& out) {
    using I = Int<kWideSize, Isa>;
    const ChildWords<Isa> words(in.word), joined(I::load(in.low), I::load(in.high));
    std::int32_t pushed[2 * kWideSize + 1] = {};  // stacks begin at multiples of 4
    words.store(in.met, pushed + 1);
    __builtin_memcpy(out.some, pushed + 1, sizeof(std::uint64_t) * kWideSize);
    joined.store(in.met, out.some_joined);
    const FarToNear order(Float<kWideSize, Isa>::load(in.enter),
                          Mask<kWideSize, Isa>::from_bits(in.met));
    words.store(order, out.ordered), joined.store(order, out.ordered_joined);
    order.store(out.child);
    for (int i = 0; i < kWideSize; ++i) out.enter[i] = order.enter[i];
}

template <class Isa>
LaneProbes make_lane_probes() {
    return {probe_lanes<1, Isa>, probe_lanes<8, Isa>, probe_lanes<16, Isa>, probe_children<Isa>};
}

}  // namespace packet::test
