#include "kernels/make_kernel_table.h"

namespace packet {

static constexpr KernelTable kTable = make_kernel_table<isa::Scalar>();

const KernelTable& kernel_table_scalar() noexcept { return kTable; }

}  // namespace packet
