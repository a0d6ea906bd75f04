#include "lane_probe.h"

packet::test::LaneProbes packet::test::lane_probes_avx512() {
    return make_lane_probes<isa::Avx512>();
}
