// Whether packets of 16 are faster than the kernel that was planned: found out by tracing some
// rays both ways, while threads trace the others.
#pragma once

#include "kernels/kernel_table.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <mutex>
#include <span>

namespace packet {

class PacketTries {
public:
    static constexpr std::size_t kCount = 9;
    /// Seconds a ray.
    struct Try {
        double planned = 0.0, packets = 0.0;
    };

    /// Packets are faster if they take less than the share `packets_below` of the other's time.
    PacketTries(KernelTable::Kernel planned, double packets_below)
        : packets_below_(packets_below), best_(planned) {}

    /// Whether more tries are needed.
    [[nodiscard]] bool is_open() const noexcept { return is_open_; }
    /// As far as is known: the planned kernel, until there are enough tries.
    [[nodiscard]] KernelTable::Kernel best() const noexcept { return best_; }

    /// Thread-safe. Two tries that leave packets no hope are enough, or a few that leave little
    /// doubt, or kCount. Those count most that take longest, not those of the sky.
    void add(const Try& made) {
        const std::scoped_lock lock(mutex_);
        if (!is_open_) return;
        tries_[made_++] = made;
        const bool is_full = made_ == kCount;
        const bool are_few = made_ < kFewest;
        const bool are_faster = !are_few && ratio() < (is_full ? packets_below_ : kClearlyFaster);
        const bool are_slower =
            made_ >= 2 && (are_few ? ratio_of_all() > kHopeless : ratio() > kClearlySlower);
        if (are_faster) best_ = KernelTable::kPacket16;
        if (is_full || are_faster || are_slower) is_open_ = false;
    }

private:
    static constexpr std::size_t kFewest = 4;
    static constexpr double kClearlyFaster = 0.75, kClearlySlower = 1.1, kHopeless = 1.25;

    /// The time of packets so far, in units of the other's.
    [[nodiscard]] double ratio_of_all() const { return ratio_without(nullptr, nullptr); }
    /// Without the two tries that speak most for either, for the system may have interrupted them.
    [[nodiscard]] double ratio() const {
        const auto [least, most] = std::ranges::minmax_element(
            made(), {}, [](const Try& t) { return t.planned - t.packets; });
        return ratio_without(&*least, &*most);
    }
    [[nodiscard]] double ratio_without(const Try* one, const Try* other) const {
        Try sum;
        for (const Try& t : made()) {
            if (&t == one || &t == other) continue;
            sum.planned += t.planned;
            sum.packets += t.packets;
        }
        return sum.packets / sum.planned;
    }
    [[nodiscard]] std::span<const Try> made() const { return std::span(tries_).first(made_); }

    double packets_below_;
    std::mutex mutex_;
    std::array<Try, kCount> tries_;
    std::size_t made_ = 0;
    std::atomic<bool> is_open_ = true;
    std::atomic<KernelTable::Kernel> best_;
};

}  // namespace packet
