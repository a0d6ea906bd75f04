#include "lane_probe.h"

packet::test::LaneProbes packet::test::lane_probes_scalar() {
    return make_lane_probes<isa::Scalar>();
}
