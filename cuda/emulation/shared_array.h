// Arrays in shared memory whose every access is checked: see grid.h.
#pragma once

#include "grid.h"

#include <bit>
#include <cstdint>

namespace packet::cuda {

/// What an element of the array is to who reads or assigns it.
template <class T>
class SharedWord {
public:
    explicit SharedWord(std::size_t word) : word_(word) {}
    operator T() const { return std::bit_cast<T>(emulation::read_shared(word_)); }
    SharedWord& operator=(T value) {
        emulation::write_shared(word_, std::bit_cast<std::uint32_t>(value));
        return *this;
    }

private:
    std::size_t word_;
};

template <class T>
class SharedArray {
    static_assert(sizeof(T) == 4);

public:
    SharedArray(std::uint32_t first_word, std::uint32_t count)
        : first_(first_word), count_(count) {}
    SharedWord<T> operator[](std::uint32_t i) const {
        if (i >= count_) emulation::fail_bounds("array in shared memory", i, count_);
        return SharedWord<T>(first_ + i);
    }

private:
    std::uint32_t first_, count_;
};

}  // namespace packet::cuda
