#include "lane_probe.h"

packet::test::LaneProbes packet::test::lane_probes_sse42() {
    return make_lane_probes<isa::Sse42>();
}
