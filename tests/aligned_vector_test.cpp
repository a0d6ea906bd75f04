// What becomes of large arrays that are freed.
#include "core/aligned_vector.h"

#include <doctest/doctest.h>

#include <cstddef>

using namespace packet;

TEST_CASE("an array lies at the front of a larger one that waits, which is whole again after it") {
    constexpr std::size_t kLarge = std::size_t{24} << 20, kSmall = std::size_t{14} << 20;
    const auto allocate = [](std::size_t bytes) {
        auto* const memory = static_cast<char*>(allocate_aligned(bytes));
        memory[0] = memory[bytes - 1] = 1;
        return memory;
    };
    char* const whole = allocate(kLarge);
    deallocate_aligned(whole, kLarge);
    char* const front = allocate(kSmall);
    CHECK(front == whole);
    char* const other = allocate(kSmall);
    CHECK((other + kSmall <= whole || whole + kLarge <= other));
    deallocate_aligned(front, kSmall);
    CHECK(allocate(kLarge) == whole);
    deallocate_aligned(other, kSmall);
    deallocate_aligned(whole, kLarge);
}
