#include "lane_probe.h"

packet::test::LaneProbes packet::test::lane_probes_avx2() { return make_lane_probes<isa::Avx2>(); }
