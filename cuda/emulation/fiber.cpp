#include "fiber.h"

#include <cstdint>
#include <cstdlib>

#if defined(__SANITIZE_ADDRESS__)
#define PACKET_ASAN 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define PACKET_ASAN 1
#endif
#endif
#if defined(PACKET_ASAN)
#include <sanitizer/common_interface_defs.h>
#endif

#if !defined(__x86_64__)
#error "switching stacks is written for x86-64; configure with -DPACKET_TESTS=OFF"
#endif

// System V keeps rbx, rbp and r12 to r15 across calls; the return address is on the stack already.
asm(R"(
.text
.type packet_switch_stack, @function
packet_switch_stack:
    pushq %rbp
    pushq %rbx
    pushq %r12
    pushq %r13
    pushq %r14
    pushq %r15
    movq %rsp, (%rdi)
    movq %rsi, %rsp
    popq %r15
    popq %r14
    popq %r13
    popq %r12
    popq %rbx
    popq %rbp
    ret
.size packet_switch_stack, .-packet_switch_stack
)");
/// Stores the stack pointer at `from` and goes on where `to` was stored.
extern "C" void packet_switch_stack(void** from, void* to);

namespace packet::emulation {

namespace {

/// Whose enter() is called next: a new stack has no room for arguments.
Fiber* entering = nullptr;

#if defined(PACKET_ASAN)
void leave_stack(void** fake, const void* stack, std::size_t bytes) {
    __sanitizer_start_switch_fiber(fake, stack, bytes);
}
void reach_stack(void* fake, const void** stack, std::size_t* bytes) {
    __sanitizer_finish_switch_fiber(fake, stack, bytes);
}
#else
void leave_stack(void**, const void*, std::size_t) {}
void reach_stack(void*, const void**, std::size_t*) {}
#endif

}  // namespace

Fiber::Fiber() : stack_(new std::byte[kStackBytes]) {}
Fiber::~Fiber() = default;

void Fiber::start(void (*function)(void*), void* argument) {
    function_ = function;
    argument_ = argument;
    fake_inside_ = nullptr;
    // As after a call: the stack pointer is 8 off a multiple of 16 when the function starts. (What
    // new yields is aligned to 16, and so is the stack's size.)
    auto* slots = reinterpret_cast<void**>(stack_.get() + kStackBytes) - 8;
    for (int i = 0; i < 6; ++i) slots[i] = nullptr;  // registers
    slots[6] = reinterpret_cast<void*>(+[] { enter(entering); });
    slots[7] = nullptr;  // a return address that ends backtraces
    inside_ = slots;
}

void Fiber::enter(Fiber* self) {
    self->arrive_inside();
    self->function_(self->argument_);
    std::abort();  // it did not end by finish()
}

void Fiber::arrive_inside() { reach_stack(fake_inside_, &outer_stack_, &outer_bytes_); }

void Fiber::resume() {
    entering = this;
    leave_stack(&fake_outside_, stack_.get(), kStackBytes);
    packet_switch_stack(&outside_, inside_);
    reach_stack(fake_outside_, nullptr, nullptr);
}

void Fiber::suspend() {
    leave_stack(&fake_inside_, outer_stack_, outer_bytes_);
    packet_switch_stack(&inside_, outside_);
    arrive_inside();
}

void Fiber::finish() {
    leave_stack(nullptr, outer_stack_, outer_bytes_);  // no fake stack is kept
    packet_switch_stack(&inside_, outside_);
    std::abort();  // nobody resumes what has finished
}

}  // namespace packet::emulation
