// What becomes of large arrays that are freed.
#include "core/aligned_vector.h"

#include <doctest/doctest.h>

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <vector>

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

TEST_CASE("pages that are given back hold no memory, until they are written anew") {
    constexpr std::size_t kBytes = std::size_t{6} << 20;
    auto* const memory = static_cast<char*>(allocate_aligned(kBytes));
    const auto resident = [&] {
        std::vector<unsigned char> pages(kBytes / static_cast<std::size_t>(sysconf(_SC_PAGESIZE)));
        REQUIRE(mincore(memory, kBytes, pages.data()) == 0);
        return static_cast<std::size_t>(std::ranges::count(pages, 1));
    };
    std::fill_n(memory, kBytes, 'x');
    CHECK(resident() != 0);
    give_back_pages(memory, kBytes);
    CHECK(resident() == 0);
    std::fill_n(memory, kBytes, 'y');
    CHECK(memory[kBytes - 1] == 'y');
    deallocate_aligned(memory, kBytes);
    char small[64] = {'z'};
    give_back_pages(small, sizeof small);
    CHECK(small[0] == 'z');
}
