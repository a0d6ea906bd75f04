#include "shared_memory.h"

#include <algorithm>

namespace packet::emulation {

static std::string describe(const char* what, std::size_t word, unsigned other) {
    return std::string("shared memory, word ") + std::to_string(word) + ": " + what + " thread " +
           std::to_string(other) + " without a barrier in between";
}

void SharedMemory::reset(std::size_t bytes, unsigned threads) {
    threads_ = threads;
    const std::size_t words = (bytes + 3) / 4;
    words_.assign(words, 0xA5A5A5A5u);
    written_.assign(words, {0, 0});
    reads_.assign(words * threads, 0);
    atomics_.assign(words * threads, 0);
    is_atomic_.assign(words, 0);
    clocks_.assign(std::size_t{threads} * threads, 0);
    for (unsigned t = 0; t < threads; ++t) clock_of(t)[t] = 1;
}

void SharedMemory::synchronize(std::span<const unsigned> threads) {
    if (words_.empty()) return;
    std::vector<std::uint32_t> latest(threads_, 0);
    for (const unsigned t : threads) {
        const std::uint32_t* clock = clock_of(t);
        for (unsigned i = 0; i < threads_; ++i) latest[i] = std::max(latest[i], clock[i]);
    }
    for (const unsigned t : threads) {
        std::copy(latest.begin(), latest.end(), clock_of(t));
        ++clock_of(t)[t];
    }
}

std::optional<unsigned> SharedMemory::find_unknown(const std::uint32_t* accesses, unsigned thread) {
    const std::uint32_t* clock = clock_of(thread);
    for (unsigned t = 0; t < threads_; ++t) {
        if (accesses[t] > clock[t]) return t;
    }
    return std::nullopt;
}

std::string SharedMemory::note_read(std::size_t word, unsigned thread) {
    if (written_[word].time == 0) {
        return "shared memory, word " + std::to_string(word) + ": read, but never written";
    }
    if (!knows_write(word, thread)) return describe("read after", word, written_[word].thread);
    if (is_atomic_[word] != 0) {
        if (const auto other = find_unknown(atomics_of(word), thread)) {
            return describe("read after an atomic of", word, *other);
        }
    }
    reads_of(word)[thread] = clock_of(thread)[thread];
    return {};
}

std::string SharedMemory::note_write(std::size_t word, unsigned thread) {
    if (!knows_write(word, thread)) {
        return describe("written after it was by", word, written_[word].thread);
    }
    if (const auto other = find_unknown(reads_of(word), thread)) {
        return describe("written after it was read by", word, *other);
    }
    if (is_atomic_[word] != 0) {
        if (const auto other = find_unknown(atomics_of(word), thread)) {
            return describe("written after an atomic of", word, *other);
        }
        std::fill_n(atomics_of(word), threads_, 0u);
        is_atomic_[word] = 0;
    }
    std::fill_n(reads_of(word), threads_, 0u);
    written_[word] = {thread, clock_of(thread)[thread]};
    return {};
}

std::string SharedMemory::note_atomic(std::size_t word, unsigned thread) {
    if (written_[word].time == 0) {
        return "shared memory, word " + std::to_string(word) + ": an atomic, but never written";
    }
    if (!knows_write(word, thread)) {
        return describe("an atomic after it was written by", word, written_[word].thread);
    }
    if (const auto other = find_unknown(reads_of(word), thread)) {
        return describe("an atomic after it was read by", word, *other);
    }
    is_atomic_[word] = 1;
    atomics_of(word)[thread] = clock_of(thread)[thread];
    return {};
}

}  // namespace packet::emulation
