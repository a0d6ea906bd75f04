// Vectors whose first element starts a cache line, and which take large pages for large arrays.
#pragma once

#include <cstddef>
#include <new>
#include <utility>
#include <vector>

namespace packet {

/// Memory that starts a cache line. From some megabytes on it is asked for in huge pages: building
/// writes more memory for the first time than it computes, and a page fault of 4 KiB at a time
/// costs several times what the work on that page does; and rays meet nodes and triangles all over
/// it.
[[nodiscard]] void* allocate_aligned(std::size_t bytes);
void deallocate_aligned(void* memory, std::size_t bytes) noexcept;
/// What an array of `bytes` holds is needed no more: the pages of a large one go to the system at
/// once, not when it wants them. It may be written anew.
void give_back_pages(void* memory, std::size_t bytes) noexcept;

template <class T>
struct CacheLineAllocator {
    using value_type = T;

    CacheLineAllocator() = default;
    template <class U>
    explicit CacheLineAllocator(const CacheLineAllocator<U>&) noexcept {}

    [[nodiscard]] T* allocate(std::size_t count) {
        return static_cast<T*>(allocate_aligned(count * sizeof(T)));
    }
    void deallocate(T* p, std::size_t count) noexcept { deallocate_aligned(p, count * sizeof(T)); }

    friend bool operator==(CacheLineAllocator, CacheLineAllocator) noexcept { return true; }
};

/// Does not initialise elements that are given no value.
template <class T>
struct ScratchAllocator : CacheLineAllocator<T> {
    using value_type = T;

    ScratchAllocator() = default;
    template <class U>
    explicit ScratchAllocator(const ScratchAllocator<U>&) noexcept {}

    template <class U>
    void construct(U*) noexcept {}
    template <class U, class... Args>
    void construct(U* p, Args&&... args) {
        ::new (static_cast<void*>(p)) U{std::forward<Args>(args)...};
    }
};

template <class T>
using AlignedVector = std::vector<T, CacheLineAllocator<T>>;

/// For plain data that several threads fill: resize() leaves new elements uninitialised, so that
/// the thread that first writes them is the first to touch their memory.
template <class T>
using ScratchVector = std::vector<T, ScratchAllocator<T>>;

}  // namespace packet
