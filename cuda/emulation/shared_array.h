// Arrays in shared memory whose every access is checked: see grid.h.
#pragma once

#include "grid.h"

#include <bit>
#include <cstdint>
#include <type_traits>

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
    SharedWord<T> operator[](std::uint32_t i) const { return SharedWord<T>(word(i)); }
    // As atomics of unsigned integers.
    void atomic_add(std::uint32_t i, T amount) const {
        change(i, amount, [](std::uint32_t a, std::uint32_t b) { return a + b; });
    }
    void atomic_min(std::uint32_t i, T value) const {
        change(i, value, [](std::uint32_t a, std::uint32_t b) { return b < a ? b : a; });
    }
    void atomic_max(std::uint32_t i, T value) const {
        change(i, value, [](std::uint32_t a, std::uint32_t b) { return a < b ? b : a; });
    }

private:
    [[nodiscard]] std::size_t word(std::uint32_t i) const {
        if (i >= count_) emulation::fail_bounds("array in shared memory", i, count_);
        return std::size_t{first_} + i;
    }
    void change(std::uint32_t i, T value,
                std::uint32_t (*combine)(std::uint32_t, std::uint32_t)) const {
        static_assert(std::is_same_v<T, std::uint32_t>);
        emulation::change_shared(word(i), combine, value);
    }

    std::uint32_t first_, count_;
};

}  // namespace packet::cuda
