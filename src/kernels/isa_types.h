// Instruction sets as types. A kernel is a template over one of these, so that copies of it
// compiled with different flags have different names and the linker can never take one for another.
#pragma once

namespace packet::isa {

struct Scalar {};
struct Sse42 {};
struct Avx2 {};
struct Avx512 {};

}  // namespace packet::isa
