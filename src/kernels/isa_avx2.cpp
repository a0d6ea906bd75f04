#include "kernels/make_kernel_table.h"

namespace packet {

static constexpr KernelTable kTable = make_kernel_table<isa::Avx2>();

const KernelTable& kernel_table_avx2() noexcept { return kTable; }

}  // namespace packet
