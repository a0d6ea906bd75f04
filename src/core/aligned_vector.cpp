// Large arrays that are freed wait here for the next ones, of their size down to half of it. The
// newest are kept as they are, as malloc does: to give them back and write to them anew cost a
// quarter of the time in which random rays were sorted and traced. To the system the pages of the
// others are free for the taking (MADV_FREE), but what it has not taken is not cleared again:
// clearing is a third of the time in which a tree is built anew over fresh memory.
#include "core/aligned_vector.h"

#include <algorithm>
#include <array>
#include <mutex>
#include <new>
#include <utility>

#if defined(__linux__)
#include <sys/mman.h>
#endif

#if defined(__SANITIZE_ADDRESS__)
#define PACKET_ADDRESS_SANITIZER
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define PACKET_ADDRESS_SANITIZER
#endif
#endif

namespace packet {

namespace {

constexpr std::size_t kCacheLine = 64;
constexpr std::size_t kSmallPages = std::size_t{64} << 10;  // whatever the system's are
constexpr std::size_t kHugePage = std::size_t{2} << 20;

/// Smaller arrays come and go within memory that the process has.
bool is_large(std::size_t bytes) noexcept { return bytes >= 8 * kSmallPages; }

/// The pages of a large array. A smaller one would waste most of a huge page.
std::size_t page_of(std::size_t bytes) noexcept {
    return bytes >= 2 * kHugePage ? kHugePage : kSmallPages;
}

std::size_t in_pages(std::size_t bytes) noexcept {
    const std::size_t page = page_of(bytes);
    return (bytes + page - 1) / page * page;
}

/// Of as many bytes as fill pages.
void* allocate_large(std::size_t bytes) {
    const std::size_t page = page_of(bytes);
    void* const memory = ::operator new (bytes, std::align_val_t{page});
#if defined(__linux__)
    // Where the system grants none, pages are small: nothing else changes.
    if (page == kHugePage) (void)madvise(memory, bytes, MADV_HUGEPAGE);
#endif
    return memory;
}

#if defined(MADV_FREE) && !defined(PACKET_ADDRESS_SANITIZER)
constexpr bool kKeepsBlocks = true;
/// Tells the system that it may take the pages, whose contents nobody needs; false if it cannot be
/// told.
bool give_away(void* memory, std::size_t bytes) noexcept {
    return madvise(memory, bytes, MADV_FREE) == 0;
}
/// Gives pages to the system at once. What it refuses stays.
void give_back(void* memory, std::size_t bytes) noexcept {
    (void)madvise(memory, bytes, MADV_DONTNEED);
}
#else  // the address sanitizer finds uses of freed memory
constexpr bool kKeepsBlocks = false;
bool give_away(void*, std::size_t) noexcept { return false; }
void give_back(void*, std::size_t) noexcept {}
#endif

void free_large(void* memory, std::size_t bytes) noexcept {
    ::operator delete (memory, std::align_val_t{page_of(bytes)});
}

/// Blocks that nobody uses. The oldest make room for others.
class SpareBlocks {
public:
    /// A block of at least `bytes`, and at most twice as many, in pages as large; or null. Of what
    /// lies behind `bytes` no more than an eighth of them may hold pages.
    [[nodiscard]] void* take(std::size_t bytes) noexcept {
        const std::scoped_lock lock(mutex_);
        Block* best = nullptr;
        for (Block& block : blocks_) {
            if (block.bytes < bytes || block.bytes > 2 * bytes) continue;
            if (page_of(block.bytes) != page_of(bytes)) continue;
            if (best == nullptr || block.bytes < best->bytes) best = &block;
        }
        if (best == nullptr || (best->bytes != bytes && !note_size(*best))) return nullptr;
        const Block taken = std::exchange(*best, Block{});
        const std::size_t left = taken.bytes - bytes;
        if (left > bytes / 8) give_back(static_cast<char*>(taken.memory) + bytes, left);
        return taken.memory;
    }

    /// Takes over a block that would else be freed, and frees those there is no more room for.
    void put(void* memory, std::size_t bytes) noexcept {
        const std::scoped_lock lock(mutex_);
        bytes = noted_size(memory, bytes);
        if (!kKeepsBlocks || bytes > kMostBytes) return free_large(memory, bytes);
        Block moved{memory, bytes, false};
        std::size_t sum = 0;
        for (Block& block : blocks_) {
            // Each moves on by one place, up to one that is empty.
            if (moved.memory != nullptr) std::swap(moved, block);
            sum += block.bytes;
            if (block.memory == nullptr || sum <= kMostBytesKept) continue;
            if (!block.is_given_away) block.is_given_away = give_away(block.memory, block.bytes);
            if (sum > kMostBytes || !block.is_given_away) free_block(std::exchange(block, Block{}));
        }
        if (moved.memory != nullptr) free_block(moved);
    }

private:
    struct Block {
        void* memory = nullptr;
        std::size_t bytes = 0;
        bool is_given_away = false;
    };
    static void free_block(const Block& block) noexcept { free_large(block.memory, block.bytes); }

    /// Of a block that is taken as a smaller one; false if no more can be noted.
    bool note_size(const Block& block) noexcept {
        Block* const free = std::ranges::find(larger_, nullptr, &Block::memory);
        if (free == larger_.end()) return false;
        *free = block;
        return true;
    }
    /// Of a block that comes back, with the size as which it was taken.
    std::size_t noted_size(void* memory, std::size_t bytes) noexcept {
        Block* const noted = std::ranges::find(larger_, memory, &Block::memory);
        return noted == larger_.end() ? bytes : std::exchange(*noted, Block{}).bytes;
    }

    // What glibc keeps of freed memory, and what it takes to sort a million rays.
    static constexpr std::size_t kMostBytesKept = std::size_t{32} << 20;
    // What a build of some million triangles uses at once.
    static constexpr std::size_t kMostBytes = std::size_t{512} << 20;

    std::mutex mutex_;
    std::array<Block, 64> blocks_;  ///< the newest first
    std::array<Block, 64> larger_;  ///< those in use as smaller ones
};

/// Never destroyed: vectors of static lifetime may be freed after anything else.
SpareBlocks& spare_blocks() {
    static SpareBlocks& blocks = *new SpareBlocks;
    return blocks;
}

}  // namespace

void* allocate_aligned(std::size_t bytes) {
    if (!is_large(bytes)) return ::operator new (bytes, std::align_val_t{kCacheLine});
    bytes = in_pages(bytes);
    void* const spare = spare_blocks().take(bytes);
    return spare != nullptr ? spare : allocate_large(bytes);
}

void deallocate_aligned(void* memory, std::size_t bytes) noexcept {
    if (is_large(bytes)) return spare_blocks().put(memory, in_pages(bytes));
    ::operator delete (memory, std::align_val_t{kCacheLine});
}

void give_back_pages(void* memory, std::size_t bytes) noexcept {
    if (is_large(bytes)) give_back(memory, in_pages(bytes));
}

}  // namespace packet
