// The instruction sets the kernels are compiled for, and which of them this CPU runs.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace packet {

/// Instruction sets, slowest first. Every one returns the same bits.
enum class IsaId : std::uint8_t { kScalar, kSse42, kAvx2, kAvx512 };

/// All instruction sets this build has kernels for, whether or not the CPU runs them.
[[nodiscard]] std::span<const IsaId> built_isas() noexcept;
[[nodiscard]] bool cpu_supports(IsaId isa) noexcept;
[[nodiscard]] std::string_view to_string(IsaId isa) noexcept;
/// Throws Error{kUnknownName} that lists the valid names.
[[nodiscard]] IsaId parse_isa(std::string_view name);

/// The instruction set used when TraceOptions names none: the environment's PACKET_ISA, else the
/// best one this CPU supports. Throws Error{kUnknownName} or Error{kUnsupported} for a bad
/// PACKET_ISA.
[[nodiscard]] IsaId default_isa();

}  // namespace packet
