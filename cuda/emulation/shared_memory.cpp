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

std::string SharedMemory::note_read(std::size_t word, unsigned thread) {
    if (written_[word].time == 0) {
        return "shared memory, word " + std::to_string(word) + ": read, but never written";
    }
    if (!knows_write(word, thread)) return describe("read after", word, written_[word].thread);
    reads_of(word)[thread] = clock_of(thread)[thread];
    return {};
}

std::string SharedMemory::note_write(std::size_t word, unsigned thread) {
    const std::uint32_t* clock = clock_of(thread);
    if (!knows_write(word, thread)) {
        return describe("written after it was by", word, written_[word].thread);
    }
    std::uint32_t* reads = reads_of(word);
    for (unsigned t = 0; t < threads_; ++t) {
        if (reads[t] > clock[t]) return describe("written after it was read by", word, t);
        reads[t] = 0;
    }
    written_[word] = {thread, clock[thread]};
    return {};
}

}  // namespace packet::emulation
