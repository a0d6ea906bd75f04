#include "step_probe.h"

packet::bench::StepProbes packet::bench::step_probes_avx512() {
    return make_step_probes<isa::Avx512>();
}
