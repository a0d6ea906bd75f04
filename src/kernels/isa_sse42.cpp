#include "kernels/make_kernel_table.h"

namespace packet {

static constexpr KernelTable kTable = make_kernel_table<isa::Sse42>();

const KernelTable& kernel_table_sse42() noexcept { return kTable; }

}  // namespace packet
