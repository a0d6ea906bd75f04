// Every way to trace a scene, for tests that hold them all to one answer. A new structure, mode or
// instruction set is in all agreement tests as soon as it is in its table.
#pragma once

#include "oracle.h"

#include <packet/packet.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace packet::test {

struct Configuration {
    AccelKind accel;
    Mode mode;
    IsaId isa;
    int threads;

    [[nodiscard]] std::string name() const;
    [[nodiscard]] TraceOptions trace_options() const;
};

/// A way to build a structure.
struct Build {
    std::string name;
    BuildOptions options;
};

/// Every structure, in each way that it is built; with binary nodes, which CUDA devices and some
/// tests need.
[[nodiscard]] std::vector<Build> all_builds();

/// The instruction sets that this CPU runs.
[[nodiscard]] std::vector<IsaId> cpu_isas();

/// Modes x instruction sets that this CPU runs, on one thread, and on 2 and 3 threads by the best
/// of them. What the CPU lacks is reported once as skipped.
[[nodiscard]] std::vector<Configuration> all_configurations(AccelKind accel);

/// Places where two lists of hits differ in any bit. Reports the first as a doctest message.
[[nodiscard]] std::size_t count_differences(std::span<const Ray> rays, std::span<const Hit> want,
                                            std::span<const Hit> got);

/// Builds every structure over the scene, in each way, traces the rays in every configuration,
/// closest-hit and any-hit, and CHECKs that all are equal to the oracle, bit for bit. `label` names
/// the case. Under a share of the work (share.h) each configuration traces other rays.
void check_agreement(Scene scene, std::span<const Ray> rays, const std::string& label);

}  // namespace packet::test
