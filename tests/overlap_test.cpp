// Both triangle-box overlap tests, of every instruction set, against integer arithmetic.
#include "build/overlap.h"
#include "dispatch/dispatch.h"
#include "overlap_pairs.h"
#include "share.h"

#include <packet/isa.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

using namespace packet;
using namespace packet::test;

namespace {

/// What the kernels get. All but one test use the first kBoxes.
struct FloatCase {
    static constexpr int kMost = 32;
    float v[3][3], lower[3][kMost], upper[3][kMost];

    [[nodiscard]] std::string describe(int box) const {
        std::string out;
        const auto add = [&](float x) {
            char text[32];
            std::snprintf(text, sizeof(text), "%a ", static_cast<double>(x));
            out += text;
        };
        for (const auto& corner : v) {
            for (const float x : corner) add(x);
        }
        for (const auto& side : lower) add(side[box]);
        for (const auto& side : upper) add(side[box]);
        return out;
    }
};

FloatCase to_floats(const OverlapCase& in) {
    bool exact = true;
    const auto to_float = [&](std::int64_t x) {
        const float out = std::ldexp(static_cast<float>(x), in.unit_exponent);
        exact &= std::ldexp(static_cast<double>(out), -in.unit_exponent) == static_cast<double>(x);
        return out;
    };
    FloatCase out;
    for (int a = 0; a < 3; ++a) {
        for (int k = 0; k < 3; ++k) out.v[k][a] = to_float(in.v[k][a]);
        for (int i = 0; i < kBoxes; ++i) {
            out.lower[a][i] = to_float(in.lower[a][i]);
            out.upper[a][i] = to_float(in.upper[a][i]);
        }
    }
    REQUIRE(exact);
    return out;
}

struct Answers {
    std::uint32_t axes, clip;
};

Answers ask(const KernelTable& kernels, const FloatCase& in, int count = kBoxes) {
    return {kernels.overlap_axes(in.v, in.lower, in.upper, count),
            kernels.overlap_clip(in.v, in.lower, in.upper, count)};
}

/// The same, box by box.
Answers ask_one_by_one(const FloatCase& in, int count = kBoxes) {
    const glm::vec3 v[3] = {{in.v[0][0], in.v[0][1], in.v[0][2]},
                            {in.v[1][0], in.v[1][1], in.v[1][2]},
                            {in.v[2][0], in.v[2][1], in.v[2][2]}};
    Answers out = {0, 0};
    for (int i = 0; i < count; ++i) {
        const Bounds3f box{{in.lower[0][i], in.lower[1][i], in.lower[2][i]},
                           {in.upper[0][i], in.upper[1][i], in.upper[2][i]}};
        out.axes |= (overlaps_by_axes(v, box) ? 1u : 0u) << i;
        out.clip |= (overlaps_by_clipping(v, box) ? 1u : 0u) << i;
    }
    return out;
}

/// Counts the boxes with a wrong answer and describes the first few.
class Tally {
public:
    void add(std::string_view what, const FloatCase& in, std::uint32_t expected,
             std::uint32_t answer) {
        pairs_ += kBoxes;
        for (std::uint32_t wrong = expected ^ answer; wrong != 0; wrong &= wrong - 1) {
            const int box = std::countr_zero(wrong);
            if (++wrong_ > 3) continue;
            MESSAGE(what << (expected >> box & 1u ? " misses " : " invents ") << in.describe(box));
        }
    }
    void add(const FloatCase& in, std::uint32_t expected, const Answers& answers) {
        overlaps_ += std::popcount(expected);
        add("axes", in, expected, answers.axes);
        add("clip", in, expected, answers.clip);
    }
    /// Fails if an answer was wrong, or if all cases were of one kind, which would prove little.
    void check() const {
        CHECK(wrong_ == 0);
        CHECK(overlaps_ * 20 > pairs_ / 2);
        CHECK(overlaps_ * 20 < pairs_ / 2 * 19);
    }

private:
    std::int64_t pairs_ = 0, overlaps_ = 0, wrong_ = 0;
};

std::uint32_t reference_bits(const OverlapCase& in) {
    std::uint32_t out = 0;
    for (int i = 0; i < kBoxes; ++i) out |= (in.reference(i) ? 1u : 0u) << i;
    return out;
}

template <class Make>
void check_isa(IsaId isa, int cases, Make make) {
    if (!cpu_supports(isa)) {
        MESSAGE("skipped: " << to_string(isa) << " (not this CPU)");
        return;
    }
    CAPTURE(to_string(isa));
    const KernelTable& kernels = select_kernels(isa);
    Tally tally;
    for (int i = 0; i < cases; ++i) {
        const OverlapCase in = make();
        const FloatCase floats = to_floats(in);
        tally.add(floats, reference_bits(in), ask(kernels, floats));
    }
    tally.check();
}

std::uint32_t wide_reference_bits(const FloatCase& in) {
    std::uint32_t out = 0;
    for (int i = 0; i < kBoxes; ++i) {
        IntegerPair<Wide> pair;
        for (int a = 0; a < 3; ++a) {
            for (int k = 0; k < 3; ++k) pair.v[k][a] = Wide::from(in.v[k][a]);
            pair.lower[a] = Wide::from(in.lower[a][i]), pair.upper[a] = Wide::from(in.upper[a][i]);
        }
        out |= (overlap_in_integers(pair) ? 1u : 0u) << i;
    }
    return out;
}

/// Finite floats of all exponents, or of neighbouring ones.
FloatCase any_floats(tools::Random& random) {
    const int spread = 1 << random.next() % 9;
    const int base = static_cast<int>(random.next() % 256);
    const auto number = [&] {
        const int exponent = base + static_cast<int>(random.next() % 512) % spread - spread / 2;
        const std::uint32_t bits = static_cast<std::uint32_t>(std::clamp(exponent, 0, 254)) << 23;
        const std::uint32_t mantissa = static_cast<std::uint32_t>(random.next()) & 0x807FFFFFu;
        return std::bit_cast<float>(bits | mantissa);
    };
    FloatCase out;
    for (auto& corner : out.v) {
        for (float& x : corner) x = number();
    }
    for (int a = 0; a < 3; ++a) {
        for (int i = 0; i < FloatCase::kMost; ++i) {
            // Planes through corners, and boxes that reach far, so that not all are apart.
            const float from = random.next() % 4 == 0 ? out.v[random.next() % 3][a] : number();
            const float to = random.next() % 2 == 0 ? out.v[random.next() % 3][a] : number();
            out.lower[a][i] = std::min(from, to), out.upper[a][i] = std::max(from, to);
        }
    }
    return out;
}

const FloatCase& unit_case() {
    static const FloatCase out = [] {
        FloatCase made = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 1}}, {}, {}};
        for (int a = 0; a < 3; ++a) {
            for (int i = 0; i < kBoxes; ++i) made.lower[a][i] = -1, made.upper[a][i] = 1;
        }
        return made;
    }();
    return out;
}

void check_answers(const FloatCase& in, std::uint32_t expected) {
    for (const IsaId isa : built_isas()) {
        if (!cpu_supports(isa)) continue;
        const Answers answers = ask(select_kernels(isa), in);
        CHECK(answers.axes == expected);
        CHECK(answers.clip == expected);
    }
    CHECK(ask_one_by_one(in).axes == expected);
    CHECK(ask_one_by_one(in).clip == expected);
}

}  // namespace

TEST_CASE("the references agree on small grids [baseline]") {
    OverlapCases cases(1);
    for (int round = 0; round < 1000; ++round) {
        const OverlapCase in = cases.on_grid(1 + round % 8);
        for (int i = 0; i < kBoxes; ++i) {
            CHECK(overlap_in_rationals(in.pair<std::int64_t>(i)) == in.reference(i));
            CHECK(overlap_in_integers(in.pair<Int128>(i)) == in.reference(i));
        }
        CHECK(wide_reference_bits(to_floats(in)) == reference_bits(in));
    }
}

TEST_CASE("boxes that touch a triangle overlap it, on every instruction set [baseline]") {
    for (const IsaId isa : built_isas()) {
        OverlapCases cases(2);
        check_isa(isa, 4000, [&] { return cases.on_grid(4); });
    }
}

TEST_CASE("both tests are right on 10 million pairs of all kinds") {
    OverlapCases cases(3);
    check_isa(default_isa(), static_cast<int>(share_of(1'250'000)), [&] { return cases.any(); });
}

TEST_CASE("every instruction set and width gives the same answers") {
    const int cases_each = static_cast<int>(share_of(50'000));
    for (const IsaId isa : built_isas()) {
        OverlapCases cases(4);
        check_isa(isa, cases_each, [&] { return cases.any(); });
    }
    OverlapCases cases(4);
    Tally tally;
    for (int i = 0; i < cases_each; ++i) {
        const OverlapCase in = cases.any();
        const FloatCase floats = to_floats(in);
        tally.add(floats, reference_bits(in), ask_one_by_one(floats));
    }
    tally.check();
}

TEST_CASE("floats of all exponents are decided exactly") {
    tools::Random random(5);
    Tally tally;
    const KernelTable& kernels = select_kernels(default_isa());
    for (int i = 0; i < 2000; ++i) {
        const FloatCase in = any_floats(random);
        tally.add(in, wide_reference_bits(in), ask(kernels, in));
    }
    tally.check();
}

TEST_CASE("boxes without points and without end are well defined [baseline]") {
    FloatCase in = unit_case();
    check_answers(in, 0xFFu);
    in.lower[0][1] = 0.5f, in.upper[0][1] = 0.25f;  // lower > upper
    in.lower[1][2] = NAN;
    in.upper[2][3] = NAN;
    for (int a = 0; a < 3; ++a) in.lower[a][4] = -INFINITY, in.upper[a][4] = INFINITY;
    for (int a = 0; a < 3; ++a) in.lower[a][5] = INFINITY, in.upper[a][5] = -INFINITY;
    in.lower[0][6] = FLT_MAX, in.upper[0][6] = INFINITY;
    check_answers(in, 0b10010001u);
}

TEST_CASE("a triangle that is not finite overlaps nothing [baseline]") {
    for (const float bad : {NAN, INFINITY, -INFINITY}) {
        for (int k = 0; k < 3; ++k) {
            for (int a = 0; a < 3; ++a) {
                FloatCase in = unit_case();
                in.v[k][a] = bad;
                check_answers(in, 0);
                for (int i = 0; i < kBoxes; ++i) in.lower[a][i] = -INFINITY, in.upper[a][i] = bad;
                check_answers(in, 0);
            }
        }
    }
}

TEST_CASE("the first boxes of many are tested as each alone [baseline]") {
    tools::Random random(7);
    for (int round = 0; round < 200; ++round) {
        const FloatCase in = any_floats(random);
        const Answers expected = ask_one_by_one(in, FloatCase::kMost);
        for (const IsaId isa : built_isas()) {
            if (!cpu_supports(isa)) continue;
            for (int count = 1; count <= FloatCase::kMost; ++count) {
                const std::uint32_t first = 0xffffffffu >> (FloatCase::kMost - count);
                const Answers answers = ask(select_kernels(isa), in, count);
                CHECK(answers.axes == (expected.axes & first));
                CHECK(answers.clip == (expected.clip & first));
            }
        }
    }
}
