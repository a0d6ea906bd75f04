#include "step_probe.h"

packet::bench::StepProbes packet::bench::step_probes_scalar() {
    return make_step_probes<isa::Scalar>();
}
