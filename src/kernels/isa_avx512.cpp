#include "kernels/make_kernel_table.h"

namespace packet {

static constexpr KernelTable kTable = make_kernel_table<isa::Avx512>();

const KernelTable& kernel_table_avx512() noexcept { return kTable; }

}  // namespace packet
