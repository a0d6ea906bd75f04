// Whether packets of 16 are faster than the kernel that was planned: found out by tracing some
// tasks both ways, while threads trace the others.
#pragma once

#include "kernels/kernel_table.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <mutex>

namespace packet {

class PacketTries {
public:
    static constexpr std::size_t kCount = 9;
    /// Seconds that a task took each way.
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

    /// Thread-safe. Two tries in a row without any hope for packets are enough, or kCount.
    void add(const Try& made) {
        const std::scoped_lock lock(mutex_);
        if (!is_open_) return;
        tries_[made_++] = made;
        if (made_ >= 2 && is_hopeless(tries_[made_ - 1]) && is_hopeless(tries_[made_ - 2])) {
            is_open_ = false;
        } else if (made_ == kCount) {
            if (ratio() < packets_below_) best_ = KernelTable::kPacket16;
            is_open_ = false;
        }
    }

private:
    [[nodiscard]] static bool is_hopeless(const Try& t) { return t.packets > 1.25 * t.planned; }
    /// The time of packets, in units of the other's. Without the two tries that speak most for
    /// either, for the system may have interrupted them.
    [[nodiscard]] double ratio() {
        std::ranges::sort(tries_, {}, [](const Try& t) { return t.planned - t.packets; });
        Try sum;
        for (std::size_t i = 1; i + 1 < kCount; ++i) {
            sum.planned += tries_[i].planned;
            sum.packets += tries_[i].packets;
        }
        return sum.packets / sum.planned;
    }

    double packets_below_;
    std::mutex mutex_;
    std::array<Try, kCount> tries_;
    std::size_t made_ = 0;
    std::atomic<bool> is_open_ = true;
    std::atomic<KernelTable::Kernel> best_;
};

}  // namespace packet
