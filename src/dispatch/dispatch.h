// Picks the kernels of an instruction set.
#pragma once

#include "kernels/kernel_table.h"

#include <packet/isa.h>

#include <optional>

namespace packet {

/// The kernels of `isa`, or of default_isa(). Throws Error{kUnsupported} if this CPU lacks it.
[[nodiscard]] const KernelTable& select_kernels(std::optional<IsaId> isa);

}  // namespace packet
