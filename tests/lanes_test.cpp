// Lanes of every instruction set, operation by operation and lane by lane, and how children are
// pushed, against scalar code.
#include "lane_probe.h"
#include "random.h"

#include <packet/isa.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <vector>

using namespace packet;
using namespace packet::test;

namespace {

constexpr float kMean[] = {
    0.0f,   -0.0f,   1.0f,           -1.0f,         INFINITY,       -INFINITY,  NAN,
    1e-45f, -1e-45f, 1.1754944e-38f, 3.4028235e38f, -3.4028235e38f, 1.0000001f, 0.99999994f};

LaneInput random_input(tools::Random& random) {
    LaneInput in;
    const auto number = [&] {
        if (random.next() % 3 == 0) return kMean[random.next() % std::size(kMean)];
        return std::bit_cast<float>(static_cast<std::uint32_t>(random.next()));
    };
    for (int lane = 0; lane < kMostLanes; ++lane) {
        in.a[lane] = number();
        in.b[lane] = random.next() % 4 == 0 ? in.a[lane] : number();
        in.i[lane] = static_cast<std::int32_t>(random.next() >> 32);
        in.j[lane] = random.next() % 4 == 0 ? in.i[lane] : static_cast<std::int32_t>(random.next());
        in.which[lane] = static_cast<std::int32_t>(random.next() % 8);
    }
    in.bits = static_cast<std::uint32_t>(random.next() >> 40) & 0xFFFFu;
    return in;
}

/// Equal bits, or both NaN: which NaN comes out is no matter.
bool same(float x, float y) {
    return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y) ||
           (std::isnan(x) && std::isnan(y));
}

bool bit(std::uint32_t bits, int lane) { return (bits >> lane & 1u) != 0; }

void check_floats(const LaneInput& in, const LaneOutput& out, int lane) {
    const float a = in.a[lane], b = in.b[lane];
    CHECK(same(out.add[lane], a + b));
    CHECK(same(out.sub[lane], a - b));
    CHECK(same(out.mul[lane], a * b));
    CHECK(same(out.div[lane], a / b));
    CHECK(same(out.abs[lane], std::fabs(a)));
    CHECK(same(out.min[lane], a < b ? a : b));
    CHECK(same(out.max[lane], a > b ? a : b));
    CHECK(same(out.broadcast[lane], in.a[0]));
    CHECK(same(out.select[lane], bit(in.bits, lane) ? a : b));
    CHECK(same(out.masked_store[lane], bit(in.bits, lane) ? a : b));
    CHECK(same(out.picked[lane], in.a[in.which[lane]]));
    CHECK(bit(out.less, lane) == (a < b));
    CHECK(bit(out.less_equal, lane) == (a <= b));
    CHECK(bit(out.greater, lane) == (a > b));
    CHECK(bit(out.greater_equal, lane) == (a >= b));
    CHECK(bit(out.equal, lane) == (a == b));
}

void check_others(const LaneInput& in, const LaneOutput& out, int lane) {
    const std::int32_t i = in.i[lane], j = in.j[lane];
    const bool m = bit(in.bits, lane), less = in.a[lane] < in.b[lane];
    CHECK(out.int_select[lane] == (m ? i : j));
    CHECK(out.int_broadcast[lane] == in.i[0]);
    CHECK(out.int_masked_store[lane] == (m ? i : j));
    CHECK(out.int_picked[lane] == in.i[in.which[lane]]);
    CHECK(bit(out.int_less, lane) == (i < j));
    CHECK(bit(out.int_less_equal, lane) == (i <= j));
    CHECK(bit(out.int_equal, lane) == (i == j));
    CHECK(bit(out.both, lane) == (less && m));
    CHECK(bit(out.either, lane) == (less || m));
    CHECK(bit(out.invert, lane) == !m);
    CHECK(bit(out.from_bits, lane) == m);
}

void check_lanes(LaneProbe probe, int lanes) {
    tools::Random random(static_cast<std::uint64_t>(lanes));
    for (int round = 0; round < 500; ++round) {
        CAPTURE(round);
        const LaneInput in = random_input(random);
        LaneOutput out;
        std::memset(&out, 0, sizeof(out));
        probe(in, out);
        for (int lane = 0; lane < lanes; ++lane) {
            CAPTURE(lane);
            check_floats(in, out, lane);
            check_others(in, out, lane);
        }
        const std::uint32_t mask = in.bits & ((1u << lanes) - 1);
        CHECK(out.from_bits == mask);
        CHECK(out.any == (mask != 0));
        CHECK(out.none == (mask == 0));
        CHECK(out.count == static_cast<std::uint32_t>(std::popcount(mask)));
    }
}

ChildInput random_children(tools::Random& random) {
    // What rays may enter a box at: any number, and infinity.
    constexpr float kEnters[] = {0.0f,    -0.0f,    1.0f,          -1.0f,         1e-45f,
                                 -1e-45f, INFINITY, 3.4028235e38f, -3.4028235e38f};
    ChildInput in;
    in.met = static_cast<std::uint32_t>(random.next() >> 40) & 0xFFu;
    for (int i = 0; i < kWideSize; ++i) {
        const float scattered = std::ldexp(static_cast<float>(random.next() >> 40),
                                           static_cast<int>(random.next() % 60) - 40);
        in.enter[i] = random.next() % 3 == 0   ? kEnters[random.next() % std::size(kEnters)]
                      : random.next() % 2 == 0 ? scattered
                                               : -scattered;
        if ((in.met >> i & 1u) == 0 && random.next() % 2 == 0) in.enter[i] = NAN;
        in.word[i] = random.next();
        in.low[i] = static_cast<std::int32_t>(random.next());
        in.high[i] = static_cast<std::int32_t>(random.next() >> 32);
    }
    return in;
}

/// As keys compare floats: without the last three bits, -0 before 0.
std::int32_t rank_of(float enter) {
    const auto bits = std::bit_cast<std::int32_t>(enter);
    return (bits ^ (bits < 0 ? 0x7FFFFFFF : 0)) & ~7;
}

void check_children(ChildProbe probe) {
    tools::Random random(8);
    for (int round = 0; round < 5000; ++round) {
        CAPTURE(round);
        const ChildInput in = random_children(random);
        constexpr std::uint64_t kUntouched = 0x123456789ABCDEF0u;
        ChildOutput out;
        for (auto* words : {out.some, out.some_joined, out.ordered, out.ordered_joined}) {
            words[kWideSize] = kUntouched;
        }
        probe(in, out);
        std::vector<int> met;
        for (int i = 0; i < kWideSize; ++i) {
            if (bit(in.met, i)) met.push_back(i);
        }
        const auto joined = [&](int i) {
            return std::uint64_t{static_cast<std::uint32_t>(in.high[i])} << 32 |
                   static_cast<std::uint32_t>(in.low[i]);
        };
        for (std::size_t k = 0; k < met.size(); ++k) {
            CHECK(out.some[k] == in.word[met[k]]);
            CHECK(out.some_joined[k] == joined(met[k]));
        }
        std::ranges::stable_sort(met, std::greater{}, [&](int i) { return rank_of(in.enter[i]); });
        for (std::size_t k = 0; k < met.size(); ++k) {
            CHECK(out.child[k] == met[k]);
            CHECK(out.ordered[k] == in.word[met[k]]);
            CHECK(out.ordered_joined[k] == joined(met[k]));
            CHECK(out.enter[k] <= in.enter[met[k]]);
            CHECK(rank_of(out.enter[k]) == rank_of(in.enter[met[k]]));
        }
        for (const auto* words : {out.some, out.some_joined, out.ordered, out.ordered_joined}) {
            CHECK(words[kWideSize] == kUntouched);
        }
    }
}

void check_isa(IsaId isa, LaneProbes (*probes)()) {
    if (!cpu_supports(isa)) {
        MESSAGE("skipped: " << to_string(isa) << " (not this CPU)");
        return;
    }
    check_lanes(probes().lanes1, 1);
    check_lanes(probes().lanes8, 8);
    check_lanes(probes().lanes16, 16);
    check_children(probes().children);
}

}  // namespace

TEST_CASE("scalar lanes compute as scalars [baseline]") {
    check_isa(IsaId::kScalar, lane_probes_scalar);
}
TEST_CASE("sse42 lanes compute as scalars [baseline]") {
    check_isa(IsaId::kSse42, lane_probes_sse42);
}
TEST_CASE("avx2 lanes compute as scalars") { check_isa(IsaId::kAvx2, lane_probes_avx2); }
TEST_CASE("avx512 lanes compute as scalars") { check_isa(IsaId::kAvx512, lane_probes_avx512); }
