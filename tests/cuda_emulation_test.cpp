// The emulation of CUDA finds what it is there to find: each kernel here has a fault that a GPU may
// or may not show.
#include "device.h"
#include "emulation/grid.h"
#include "emulation/shared_array.h"

#include <doctest/doctest.h>

#include <functional>
#include <string>
#include <vector>

using namespace packet::cuda;
using packet::emulation::EmulationError;
using packet::emulation::Order;
using packet::emulation::run_grid;
using packet::emulation::set_order;

TEST_SUITE_BEGIN("cuda_emulation");

namespace {

constexpr unsigned kSharedBytes = 64 * 4;

/// What the emulation says of a kernel, in each order of threads. Empty if it is right in all.
std::vector<std::string> faults_of(const std::function<void()>& kernel, unsigned threads = 32) {
    std::vector<std::string> faults;
    for (const Order order : {Order::kForward, Order::kReverse, Order::kRandom}) {
        set_order(order, 7);
        try {
            run_grid({1, threads, kSharedBytes}, kernel);
        } catch (const EmulationError& error) {
            faults.emplace_back(error.what());
        }
    }
    set_order(Order::kForward);
    return faults;
}

/// That it is found in every order, by words that its description holds.
void check_found(const std::function<void()>& kernel, const std::string& words,
                 unsigned threads = 32) {
    const std::vector<std::string> faults = faults_of(kernel, threads);
    CHECK(faults.size() == 3);
    for (const std::string& fault : faults) {
        INFO(fault);
        CHECK(fault.find(words) != std::string::npos);
        CHECK(fault.find("lane") != std::string::npos);
    }
}

unsigned rotate_through_shared_memory(bool syncs_before, bool syncs_after) {
    const SharedArray<unsigned> slots(0, 32);
    unsigned value = lane_id();
    for (int round = 0; round < 3; ++round) {
        slots[lane_id()] = value;
        if (syncs_before) __syncwarp();
        value = slots[(lane_id() + 1) % 32];
        if (syncs_after) __syncwarp();
    }
    return value;
}

}  // namespace

TEST_CASE("votes and shuffles do what they do on a GPU") {
    std::vector<unsigned> ballots(64), rotated(64), halves(64);
    std::vector<int> any(64), all(64);
    const auto kernel = [&] {
        const unsigned i = threadIdx.x;
        ballots[i] = __ballot_sync(kFullWarp, i % 3 == 0);
        rotated[i] = __shfl_sync(kFullWarp, i, static_cast<int>(lane_id() + 1));
        any[i] = __any_sync(kFullWarp, i == 40);
        all[i] = __all_sync(kFullWarp, i < 32);
        // Halves of a warp go separate ways and meet again.
        const unsigned half = lane_id() < 16 ? 0x0000FFFFu : 0xFFFF0000u;
        if (lane_id() < 16) {
            halves[i] = __ballot_sync(half, i % 2);
        } else {
            halves[i] = __ballot_sync(half, 1);
        }
        __syncwarp();
    };
    CHECK(faults_of(kernel, 64).empty());
    for (unsigned i = 0; i < 64; ++i) {
        CHECK(ballots[i] == (i < 32 ? 0x49249249u : 0x92492492u));
        CHECK(rotated[i] == i / 32 * 32 + (i + 1) % 32);
        CHECK(any[i] == (i >= 32));
        CHECK(all[i] == (i < 32));
        CHECK(halves[i] == (i % 32 < 16 ? 0x0000AAAAu : 0xFFFF0000u));
    }
}

TEST_CASE("shared memory between barriers, and atomics") {
    std::vector<unsigned> out(64);
    unsigned sum = 0;
    const auto kernel = [&] {
        const SharedArray<unsigned> slots(0, 64);
        slots[threadIdx.x] = threadIdx.x;
        __syncthreads();
        out[threadIdx.x] = slots[63 - threadIdx.x];
        atomicAdd(&sum, 1u);
    };
    CHECK(faults_of(kernel, 64).empty());
    for (unsigned i = 0; i < 64; ++i) CHECK(out[i] == 63 - i);
    CHECK(sum == 3 * 64);
    CHECK(faults_of([] { rotate_through_shared_memory(true, true); }).empty());
}

TEST_CASE("a missing __syncwarp is found, in whatever order the lanes run") {
    check_found([] { rotate_through_shared_memory(false, true); }, "shared memory");
    check_found([] { rotate_through_shared_memory(true, false); }, "without a barrier");
    // A vote is no barrier to memory.
    check_found(
        [] {
            const SharedArray<unsigned> slots(0, 32);
            if (lane_id() == 0) slots[0] = 1;
            __ballot_sync(kFullWarp, 1);
            (void)static_cast<unsigned>(slots[0]);
        },
        "read after thread 0 without a barrier");
}

TEST_CASE("atomics in shared memory do not race with each other, but with all else") {
    const auto start = [](const SharedArray<unsigned>& slots) {
        if (threadIdx.x == 0) slots[0] = 0;
    };
    std::vector<unsigned> sums(64);
    const auto count = [&] {
        const SharedArray<unsigned> slots(0, 1);
        start(slots);
        __syncthreads();
        slots.atomic_add(0, threadIdx.x);
        __syncthreads();
        sums[threadIdx.x] = slots[0];
    };
    CHECK(faults_of(count, 64).empty());
    for (const unsigned sum : sums) CHECK(sum == 64 * 63 / 2);
    check_found(
        [&] {
            const SharedArray<unsigned> slots(0, 1);
            start(slots);
            slots.atomic_add(0, 1u);
        },
        "atomic");
    check_found(
        [&] {
            const SharedArray<unsigned> slots(0, 1);
            start(slots);
            __syncthreads();
            slots.atomic_add(0, 1u);
            (void)static_cast<unsigned>(slots[0]);
        },
        "without a barrier", 64);
    check_found(
        [&] {
            const SharedArray<unsigned> slots(0, 1);
            start(slots);
            __syncthreads();
            slots.atomic_add(0, 1u);
            if (threadIdx.x == 5) slots[0] = 7;
        },
        "without a barrier");
    check_found([&] { SharedArray<unsigned>(0, 4).atomic_add(0, 1u); }, "never written");
    check_found([&] { SharedArray<unsigned>(0, 4).atomic_add(4 + lane_id(), 1u); }, "of 4");
}

TEST_CASE("wrong masks are found") {
    check_found([] { __ballot_sync(0x0000FFFFu, 1); }, "leaves out the lane that calls it");
    check_found(
        [] {
            if (lane_id() >= 4) __ballot_sync(kFullWarp, 1);  // names lanes that leave
        },
        "0xffffffff");
    check_found(
        [] {
            // The two halves of the warp vote with masks that do not match.
            __ballot_sync(lane_id() < 16 ? kFullWarp : 0xFFFF0000u, 1);
        },
        "__ballot_sync");
    check_found([] { __shfl_sync(1u << lane_id(), 1, static_cast<int>(lane_id() + 1)); },
                "which is not in it");
    check_found([] { __ballot_sync(kFullWarp, 1); }, "does not exist", 24);
}

TEST_CASE("lanes that never meet are found") {
    check_found(
        [] {
            if (lane_id() < 16) {
                __syncwarp();
            } else {
                __ballot_sync(kFullWarp, 1);
            }
        },
        "waits at");
    check_found(
        [] {
            if (threadIdx.x < 32) __syncthreads();
        },
        "__syncthreads", 64);
}

TEST_CASE("shared memory out of bounds, or never written, is found") {
    check_found(
        [] {
            const SharedArray<unsigned> slots(0, 16);
            slots[lane_id()] = 1;
        },
        "of 16");
    check_found(
        [] {
            const SharedArray<unsigned> slots(0, 1000);
            slots[500 + lane_id()] = 1;
        },
        "of 64");
    check_found(
        [] {
            const SharedArray<unsigned> slots(0, 32);
            (void)static_cast<unsigned>(slots[lane_id()]);
        },
        "never written");
}
