// When packets are taken for faster than the kernel that was planned.
#include "schedule/packet_tries.h"

#include <doctest/doctest.h>

using namespace packet;

TEST_CASE("two tries without hope end it, if they are worth more than the sky") {
    PacketTries tries(KernelTable::kTile, 0.95);
    tries.add({0.1, 0.2});
    CHECK(tries.is_open());
    tries.add({1.0, 0.9});
    CHECK(tries.is_open());
    tries.add({1.0, 2.0});
    CHECK_FALSE(tries.is_open());
    CHECK(tries.best() == KernelTable::kTile);
}

TEST_CASE("packets that are faster in all take the rest, though one task was interrupted") {
    for (const bool are_faster : {false, true}) {
        PacketTries tries(KernelTable::kTile, 0.95);
        for (std::size_t i = 0; i < PacketTries::kCount; ++i) {
            CHECK(tries.is_open());
            CHECK(tries.best() == KernelTable::kTile);
            PacketTries::Try made{1.0, are_faster ? 0.9 : 1.0};
            if (i == 4) (are_faster ? made.packets : made.planned) += 100.0;
            tries.add(made);
        }
        CHECK_FALSE(tries.is_open());
        CHECK(tries.best() == (are_faster ? KernelTable::kPacket16 : KernelTable::kTile));
        tries.add({1.0, 100.0});  // of a thread that was late
        CHECK(tries.best() == (are_faster ? KernelTable::kPacket16 : KernelTable::kTile));
    }
}

TEST_CASE("four tries that leave little doubt end it for packets, whatever cheap ones say") {
    PacketTries tries(KernelTable::kTile, 0.95);
    tries.add({1.0, 0.6});
    tries.add({0.1, 0.2});  // of rays that miss the scene
    tries.add({1.0, 0.7});
    CHECK(tries.is_open());
    CHECK(tries.best() == KernelTable::kTile);
    tries.add({0.1, 0.12});
    CHECK_FALSE(tries.is_open());
    CHECK(tries.best() == KernelTable::kPacket16);
}

TEST_CASE("four tries that leave little doubt end it for the other kernel") {
    PacketTries tries(KernelTable::kTile, 0.95);
    for (int i = 0; i < 4; ++i) {
        CHECK(tries.is_open());
        tries.add({1.0, 1.15});
    }
    CHECK_FALSE(tries.is_open());
    CHECK(tries.best() == KernelTable::kTile);
}

TEST_CASE("one interrupted task among four is no proof") {
    PacketTries tries(KernelTable::kTile, 0.95);
    tries.add({100.0, 1.0});
    for (int i = 0; i < 3; ++i) tries.add({1.0, 1.0});
    CHECK(tries.is_open());
}
