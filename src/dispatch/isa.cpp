#include "core/names.h"
#include "dispatch/dispatch.h"

#include <array>
#include <cstdlib>

namespace packet {

namespace {

struct IsaEntry {
    IsaId id;
    std::string_view name;
    const KernelTable& (*kernels)() noexcept;
    bool (*supported)() noexcept;
};

bool always() noexcept { return true; }
// Single features, each of which the kernels' flags enable: compilers differ in the names of
// levels.
bool has_sse42() noexcept {
    return __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
}
bool has_avx2() noexcept {
    return has_sse42() && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
           __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
}
bool has_avx512() noexcept {
    return has_avx2() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("avx512bw");
}

constexpr std::array kIsas = {
    IsaEntry{IsaId::kScalar, "scalar", kernel_table_scalar, always},
    IsaEntry{IsaId::kSse42, "sse42", kernel_table_sse42, has_sse42},
    IsaEntry{IsaId::kAvx2, "avx2", kernel_table_avx2, has_avx2},
    IsaEntry{IsaId::kAvx512, "avx512", kernel_table_avx512, has_avx512},
};
constexpr std::array kBuiltIsas = {IsaId::kScalar, IsaId::kSse42, IsaId::kAvx2, IsaId::kAvx512};

const IsaEntry& entry_of(IsaId isa) noexcept { return kIsas[static_cast<std::size_t>(isa)]; }

void require_support(IsaId isa, const char* origin) {
    if (cpu_supports(isa)) return;
    std::string supported;
    for (const IsaEntry& entry : kIsas) {
        if (!entry.supported()) continue;
        supported += (supported.empty() ? "" : ", ") + std::string(entry.name);
    }
    throw Error(ErrorCode::kUnsupported,
                origin + std::string(entry_of(isa).name) +
                    " is not supported by this CPU; it runs: " + supported);
}

}  // namespace

std::span<const IsaId> built_isas() noexcept { return kBuiltIsas; }
bool cpu_supports(IsaId isa) noexcept { return entry_of(isa).supported(); }
std::string_view to_string(IsaId isa) noexcept { return entry_of(isa).name; }
IsaId parse_isa(std::string_view name) { return find_by_name(kIsas, name, "instruction set").id; }

IsaId default_isa() {
    if (const char* forced = std::getenv("PACKET_ISA"); forced != nullptr && *forced != '\0') {
        const IsaId isa = find_by_name(kIsas, forced, "instruction set in PACKET_ISA").id;
        require_support(isa, "PACKET_ISA=");
        return isa;
    }
    IsaId best = IsaId::kScalar;
    for (const IsaEntry& entry : kIsas) {
        if (entry.supported()) best = entry.id;
    }
    return best;
}

const KernelTable& select_kernels(std::optional<IsaId> isa) {
    if (isa) {
        require_support(*isa, "instruction set ");
        return entry_of(*isa).kernels();
    }
    static const KernelTable& chosen = entry_of(default_isa()).kernels();
    return chosen;
}

}  // namespace packet
