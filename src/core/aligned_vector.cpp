#include "core/aligned_vector.h"

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace packet {

static constexpr std::size_t kCacheLine = 64;
static constexpr std::size_t kHugePage = std::size_t{2} << 20;

/// Small arrays would waste most of a huge page.
static bool is_large(std::size_t bytes) noexcept { return bytes >= 2 * kHugePage; }

void* allocate_aligned(std::size_t bytes) {
    if (!is_large(bytes)) return ::operator new (bytes, std::align_val_t{kCacheLine});
    bytes = (bytes + kHugePage - 1) / kHugePage * kHugePage;
    void* const memory = ::operator new (bytes, std::align_val_t{kHugePage});
#if defined(__linux__)
    // Where the system grants none, pages are small: nothing else changes.
    (void)madvise(memory, bytes, MADV_HUGEPAGE);
#endif
    return memory;
}

void deallocate_aligned(void* memory, std::size_t bytes) noexcept {
    ::operator delete (memory, std::align_val_t{is_large(bytes) ? kHugePage : kCacheLine});
}

}  // namespace packet
