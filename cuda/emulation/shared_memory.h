// A block's shared memory, with a record of who read and wrote each word, and when. Time is a
// vector clock a thread: barriers bring those of their threads together, nothing else does. Two
// accesses, one of them a write, of which neither's time is known to the other thread, race; but
// atomics do not race with each other.
//
// Flanagan, Freund. FastTrack: efficient and precise dynamic race detection. PLDI 2009.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace packet::emulation {

class SharedMemory {
public:
    /// Nothing has been written, by a block of so many threads.
    void reset(std::size_t bytes, unsigned threads);

    [[nodiscard]] std::size_t word_count() const { return words_.size(); }
    [[nodiscard]] std::uint32_t& word(std::size_t i) { return words_[i]; }

    /// A barrier of these threads.
    void synchronize(std::span<const unsigned> threads);
    /// Yields what is wrong with the access, or nothing.
    [[nodiscard]] std::string note_read(std::size_t word, unsigned thread);
    [[nodiscard]] std::string note_write(std::size_t word, unsigned thread);
    [[nodiscard]] std::string note_atomic(std::size_t word, unsigned thread);

private:
    [[nodiscard]] std::uint32_t* clock_of(unsigned thread) {
        return clocks_.data() + std::size_t{thread} * threads_;
    }
    [[nodiscard]] std::uint32_t* reads_of(std::size_t word) {
        return reads_.data() + word * threads_;
    }
    [[nodiscard]] std::uint32_t* atomics_of(std::size_t word) {
        return atomics_.data() + word * threads_;
    }
    /// A thread whose access of these `thread` does not know of, or none.
    [[nodiscard]] std::optional<unsigned> find_unknown(const std::uint32_t* accesses,
                                                       unsigned thread);
    /// Whether `thread` knows of all that the writer of the word did up to then.
    [[nodiscard]] bool knows_write(std::size_t word, unsigned thread) {
        return written_[word].time <= clock_of(thread)[written_[word].thread];
    }

    struct Write {
        unsigned thread;
        std::uint32_t time;  ///< 0: never
    };

    unsigned threads_ = 0;
    std::vector<std::uint32_t> words_;
    std::vector<std::uint32_t> clocks_;    ///< [thread][of thread]
    std::vector<std::uint32_t> reads_;     ///< [word][by thread]: time of the last, since the write
    std::vector<std::uint32_t> atomics_;   ///< [word][by thread]: as reads_
    std::vector<std::uint8_t> is_atomic_;  ///< [word]: some thread has done one since the write
    std::vector<Write> written_;           ///< [word]
};

}  // namespace packet::emulation
