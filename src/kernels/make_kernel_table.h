// Fills the table of kernels for one instruction set.
#pragma once

#include "kernels/kernel_table.h"
#include "kernels/stream_batch.h"
#include "kernels/stream_keys.h"
#include "kernels/trace_batch.h"
#include "kernels/treelet_run.h"
#include "kernels/triangle_box_axes.h"
#include "kernels/triangle_box_clip.h"

namespace packet {

/// All kernels of an instruction set. Each isa_*.cpp fills one.
template <class Isa>
constexpr KernelTable make_kernel_table() {
    KernelTable table = {};
    const auto fill = [&]<Query query, class Stats>(auto& kernels, KernelTable::Counting counting) {
        kernels[KernelTable::kSingle][counting] = trace_batch_singly<query, Isa, Stats>;
        kernels[KernelTable::kPacket8][counting] = trace_batch_by_packets<query, 8, Isa, Stats>;
        kernels[KernelTable::kPacket16][counting] = trace_batch_by_packets<query, 16, Isa, Stats>;
        kernels[KernelTable::kStream][counting] = trace_batch_by_streams<query, Isa, Stats>;
        kernels[KernelTable::kTile][counting] = trace_batch_by_tiles<query, Isa, Stats>;
    };
    using KT = KernelTable;
    fill.template operator()<Query::kClosest, NoCounters>(table.closest, KT::kNotCounting);
    fill.template operator()<Query::kClosest, Counters>(table.closest, KT::kCounting);
    fill.template operator()<Query::kAny, NoCounters>(table.any, KT::kNotCounting);
    fill.template operator()<Query::kAny, Counters>(table.any, KT::kCounting);
    table.closest_treelet[KT::kNotCounting] = run_treelet<Query::kClosest, Isa, NoCounters>;
    table.closest_treelet[KT::kCounting] = run_treelet<Query::kClosest, Isa, Counters>;
    table.any_treelet[KT::kNotCounting] = run_treelet<Query::kAny, Isa, NoCounters>;
    table.any_treelet[KT::kCounting] = run_treelet<Query::kAny, Isa, Counters>;
    table.stream_keys = find_stream_keys<Isa>;
    table.closest_ray = closest_ray<Isa>;
    table.any_ray = any_ray<Isa>;
    table.closest8 = closest_packet<8, Isa>;
    table.closest16 = closest_packet<16, Isa>;
    table.any8 = any_packet<8, Isa>;
    table.any16 = any_packet<16, Isa>;
    table.overlap_axes = overlap_axes<8, Isa, 32>;
    table.overlap_clip = overlap_clip<8, Isa, 32>;
    return table;
}

}  // namespace packet
