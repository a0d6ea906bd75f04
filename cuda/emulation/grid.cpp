#include "grid.h"

#include "cuda_runtime.h"
#include "fiber.h"
#include "shared_memory.h"

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <numeric>
#include <random>
#include <span>
#include <vector>

namespace packet::emulation {

namespace {

constexpr unsigned kWarp = 32;
// So many blocks run side by side: enough to compete for tiles.
constexpr unsigned kResidentBlocks = 2;

enum class State : std::uint8_t { kReady, kWaiting, kDone };

const char* name(Operation operation) {
    switch (operation) {
        case Operation::kBallot: return "__ballot_sync";
        case Operation::kAny: return "__any_sync";
        case Operation::kAll: return "__all_sync";
        case Operation::kShuffle: return "__shfl_sync";
        case Operation::kSyncWarp: return "__syncwarp";
        case Operation::kSyncThreads: return "__syncthreads";
    }
    return "?";
}

std::string hexadecimal(std::uint32_t mask) {
    constexpr char kDigits[] = "0123456789abcdef";
    std::string out = "0x";
    for (int shift = 28; shift >= 0; shift -= 4) out += kDigits[mask >> shift & 15u];
    return out;
}

struct Block;

struct Thread {
    Fiber fiber;
    Block* block = nullptr;
    unsigned index = 0;  ///< in the block
    State state = State::kReady;
    Operation operation = Operation::kBallot;  ///< what it waits for
    std::uint32_t mask = 0;
    unsigned source = 0;
    std::uint64_t value = 0, result = 0;  ///< what it brings there, and what it gets

    [[nodiscard]] unsigned lane() const { return index % kWarp; }
    [[nodiscard]] std::string where() const;
};

struct Block {
    unsigned index = 0;
    std::vector<std::unique_ptr<Thread>> threads;
    SharedMemory shared;

    /// The thread's warp has one of that lane.
    [[nodiscard]] Thread* lane_of(const Thread& thread, unsigned lane) const {
        const unsigned i = thread.index - thread.lane() + lane;
        return i < threads.size() ? threads[i].get() : nullptr;
    }
};

std::string Thread::where() const {
    return "block " + std::to_string(block->index) + " thread " + std::to_string(index) +
           " (lane " + std::to_string(lane()) + ")";
}

/// All that is running. There is one, since CUDA's names for the running thread are global.
struct Machine {
    Order order = Order::kForward;
    std::mt19937_64 random;
    const std::function<void()>* kernel = nullptr;
    std::vector<Block> blocks;
    Thread* running = nullptr;
    std::string failure;                        ///< of the launch; it ends as soon as there is one
    std::vector<std::unique_ptr<Thread>> idle;  ///< fibers to use again
};

Machine& machine() {
    static Machine one;
    return one;
}

/// Ends the launch. Other threads are never resumed, so what they own where they wait is lost: it
/// is nothing.
[[noreturn]] void fail(const std::string& what) {
    throw EmulationError(machine().running->where() + ": " + what);
}

/// Gives each of the threads what the operation yields for it, and lets them go on.
void complete(std::span<Thread* const> threads) {
    std::uint32_t votes = 0, asked = 0;
    for (const Thread* t : threads) {
        asked |= 1u << t->lane();
        if (t->value != 0) votes |= 1u << t->lane();
    }
    for (Thread* t : threads) {
        t->state = State::kReady;
        switch (t->operation) {
            case Operation::kBallot: t->result = votes; break;
            case Operation::kAny: t->result = votes != 0; break;
            case Operation::kAll: t->result = votes == asked; break;
            case Operation::kShuffle: t->result = t->block->lane_of(*t, t->source)->value; break;
            case Operation::kSyncWarp:
            case Operation::kSyncThreads: t->result = 0; break;
        }
    }
}

/// Waits until all lanes of the mask are there. Whoever comes last finds them all.
void complete_if_all_there(Thread& self) {
    std::array<Thread*, kWarp> there;
    std::array<unsigned, kWarp> indices;
    std::size_t count = 0;
    for (std::uint32_t left = self.mask; left != 0; left &= left - 1) {
        const auto lane = static_cast<unsigned>(std::countr_zero(left));
        Thread* other = self.block->lane_of(self, lane);
        const auto says = [&](const std::string& what) {
            return std::string(name(self.operation)) + " with mask " + hexadecimal(self.mask) +
                   " names lane " + std::to_string(lane) + ", which " + what;
        };
        if (other == nullptr) fail(says("does not exist"));
        if (other->state == State::kDone) fail(says("has left the kernel"));
        if (other->state != State::kWaiting || other->mask != self.mask) return;
        if (other->operation != self.operation) {
            fail(says("waits at " + std::string(name(other->operation))));
        }
        indices[count] = other->index;
        there[count++] = other;
    }
    if (self.operation == Operation::kSyncWarp) {
        self.block->shared.synchronize(std::span(indices).first(count));
    }
    complete(std::span(there).first(count));
}

void suspend(Thread& self) { self.fiber.suspend(); }

void run_thread(void* argument) {
    Thread& self = *static_cast<Thread*>(argument);
    try {
        (*machine().kernel)();
    } catch (const EmulationError& error) {
        machine().failure = error.what();
    }
    // Others may wait for it in vain: told when they are looked at, or when nothing moves any more.
    self.state = State::kDone;
    self.fiber.finish();
}

void start_block(Block& block, unsigned index, const Shape& shape) {
    Machine& m = machine();
    block.index = index;
    block.shared.reset(shape.shared_bytes, shape.threads);
    for (unsigned i = 0; i < shape.threads; ++i) {
        if (m.idle.empty()) m.idle.push_back(std::make_unique<Thread>());
        std::unique_ptr<Thread> thread = std::move(m.idle.back());
        m.idle.pop_back();
        thread->block = &block;
        thread->index = i;
        thread->state = State::kReady;
        thread->fiber.start(run_thread, thread.get());
        block.threads.push_back(std::move(thread));
    }
}

void end_block(Block& block) {
    for (auto& thread : block.threads) machine().idle.push_back(std::move(thread));
    block.threads.clear();
}

void resume(Thread& thread) {
    machine().running = &thread;
    threadIdx = {thread.index, 0, 0};
    blockIdx = {thread.block->index, 0, 0};
    thread.fiber.resume();
    machine().running = nullptr;
}

std::string describe_deadlock(const std::vector<Thread*>& threads) {
    std::string out = "deadlock:";
    int told = 0;
    for (const Thread* t : threads) {
        if (t->state != State::kWaiting) continue;
        if (++told > 8) return out + " and more";
        out += "\n  " + t->where() + " waits at " + name(t->operation);
        if (t->operation != Operation::kSyncThreads) out += " for " + hexadecimal(t->mask);
    }
    return out;
}

/// Runs the resident blocks' threads in turn until all are done.
void run_resident(const std::vector<Thread*>& threads) {
    Machine& m = machine();
    std::vector<std::size_t> turns(threads.size());
    std::iota(turns.begin(), turns.end(), std::size_t{0});
    if (m.order == Order::kReverse) std::reverse(turns.begin(), turns.end());
    for (;;) {
        if (m.order == Order::kRandom) std::shuffle(turns.begin(), turns.end(), m.random);
        bool moved = false, all_done = true;
        for (const std::size_t i : turns) {
            Thread& thread = *threads[i];
            if (thread.state == State::kReady) {
                resume(thread);
                moved = true;
                if (!m.failure.empty()) return;
            }
            all_done = all_done && thread.state == State::kDone;
        }
        if (all_done) return;
        if (!moved) {
            m.failure = describe_deadlock(threads);
            return;
        }
    }
}

}  // namespace

void set_order(Order order, std::uint64_t seed) {
    machine().order = order;
    machine().random.seed(seed);
}

void run_grid(const Shape& shape, const std::function<void()>& kernel) {
    Machine& m = machine();
    m.kernel = &kernel;
    m.failure.clear();
    blockDim = {shape.threads, 1, 1};
    gridDim = {shape.blocks, 1, 1};
    m.blocks.resize(kResidentBlocks);
    for (unsigned first = 0; first < shape.blocks; first += kResidentBlocks) {
        std::vector<Thread*> threads;
        const unsigned count = std::min(kResidentBlocks, shape.blocks - first);
        for (unsigned i = 0; i < count; ++i) start_block(m.blocks[i], first + i, shape);
        for (unsigned i = 0; i < count; ++i) {
            for (auto& thread : m.blocks[i].threads) threads.push_back(thread.get());
        }
        run_resident(threads);
        for (Block& block : m.blocks) end_block(block);
        if (!m.failure.empty()) throw EmulationError(m.failure);
    }
}

std::uint64_t meet(Operation operation, std::uint32_t mask, std::uint64_t value, unsigned source) {
    Thread& self = *machine().running;
    if ((mask >> self.lane() & 1u) == 0) {
        fail(std::string(name(operation)) + " with mask " + hexadecimal(mask) +
             " leaves out the lane that calls it");
    }
    if (operation == Operation::kShuffle && (mask >> source & 1u) == 0) {
        fail("__shfl_sync with mask " + hexadecimal(mask) + " asks lane " + std::to_string(source) +
             ", which is not in it");
    }
    self.operation = operation;
    self.mask = mask;
    self.value = value;
    self.source = source;
    self.state = State::kWaiting;
    complete_if_all_there(self);
    suspend(self);
    return self.result;
}

/// Whoever of the block comes last finds all there.
static void complete_if_block_is_there(Thread& self) {
    std::vector<Thread*> there;
    std::vector<unsigned> indices;
    for (const auto& thread : self.block->threads) {
        if (thread->state == State::kDone) {
            fail("__syncthreads, but " + thread->where() + " has left the kernel");
        }
        if (thread->state != State::kWaiting || thread->operation != Operation::kSyncThreads) {
            return;
        }
        there.push_back(thread.get());
        indices.push_back(thread->index);
    }
    self.block->shared.synchronize(indices);
    complete(there);
}

void sync_threads() {
    Thread& self = *machine().running;
    self.operation = Operation::kSyncThreads;
    self.state = State::kWaiting;
    self.mask = 0;
    complete_if_block_is_there(self);
    suspend(self);
}

void yield() { suspend(*machine().running); }

std::uint32_t read_shared(std::size_t word) {
    const Thread& self = *machine().running;
    SharedMemory& shared = self.block->shared;
    if (word >= shared.word_count()) fail_bounds("shared memory", word, shared.word_count());
    const std::string fault = shared.note_read(word, self.index);
    if (!fault.empty()) fail(fault);
    return shared.word(word);
}

void write_shared(std::size_t word, std::uint32_t value) {
    const Thread& self = *machine().running;
    SharedMemory& shared = self.block->shared;
    if (word >= shared.word_count()) fail_bounds("shared memory", word, shared.word_count());
    const std::string fault = shared.note_write(word, self.index);
    if (!fault.empty()) fail(fault);
    shared.word(word) = value;
}

void change_shared(std::size_t word, std::uint32_t (*combine)(std::uint32_t, std::uint32_t),
                   std::uint32_t value) {
    yield();
    const Thread& self = *machine().running;
    SharedMemory& shared = self.block->shared;
    if (word >= shared.word_count()) fail_bounds("shared memory", word, shared.word_count());
    const std::string fault = shared.note_atomic(word, self.index);
    if (!fault.empty()) fail(fault);
    shared.word(word) = combine(shared.word(word), value);
}

void fail_bounds(const char* what, std::size_t index, std::size_t count) {
    fail(std::string(what) + ": index " + std::to_string(index) + " of " + std::to_string(count));
}

}  // namespace packet::emulation
