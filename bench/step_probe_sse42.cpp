#include "step_probe.h"

packet::bench::StepProbes packet::bench::step_probes_sse42() {
    return make_step_probes<isa::Sse42>();
}
