#include "build/object_split.h"

#include <cmath>
#include <cstddef>

namespace packet {

Binning::Binning(const Bounds3f& centroids) {
    for (int a = 0; a < 3; ++a) {
        const float extent = centroids.upper[a] - centroids.lower[a];
        const float s = static_cast<float>(kBinCount) * 0.999f / extent;
        if (extent > 0.0f && std::isfinite(s)) scale_vector_[a] = s;
    }
    origin_ = load_lanes(centroids.lower);
    scale_ = load_lanes(scale_vector_);
}

namespace {

struct Bin {
    LaneBox box[3];
    AxisCounts count;

    [[nodiscard]] const AxisCounts& begins() const { return count; }
    [[nodiscard]] const AxisCounts& ends() const { return count; }
};

struct Bins {
    Bin bin[kBinCount];

    void add(const Reference& r, const Binning& binning) {
        const LaneBox box = lane_box(r);
        const Binning::BinIds ids = binning.bins(r);
        for (int a = 0; a < 3; ++a) {
            Bin& at = bin[ids.axis[a]];
            at.box[a].extend(box);
            ++at.count.axis[a];
        }
    }
    void add(const Bins& other) {
        for (int i = 0; i < kBinCount; ++i) {
            for (int a = 0; a < 3; ++a) bin[i].box[a].extend(other.bin[i].box[a]);
            bin[i].count.add(other.bin[i].count);
        }
    }
};

}  // namespace

ObjectSplit find_object_split(ReferenceSpan refs, const Binning& binning,
                              const Parallel& parallel) {
    ObjectSplit best;
    if (!binning.splits_any()) return best;
    const Bins bins = fold_references<Bins>(
        refs, parallel,
        [&](Bins& out, ReferenceSpan piece) {
            for (const Reference& r : piece) out.add(r, binning);
        },
        [](Bins& a, const Bins& b) { a.add(b); });
    const Borders borders = find_borders(bins.bin, std::numeric_limits<float>::infinity());
    for (int a = 0; a < 3; ++a) {
        if (!binning.splits(a) || !(borders.cost[a] < best.cost)) continue;
        best.cost = borders.cost[a];
        best.axis = a;
        best.bin = static_cast<int>(borders.bin[a]);
    }
    best.bounds[0] = join_bins(bins.bin, best.axis, 0, best.bin);
    best.bounds[1] = join_bins(bins.bin, best.axis, best.bin, kBinCount);
    return best;
}

bool is_leaf(const NodeRange& node, float split_cost, const BuildOptions& options) {
    const std::size_t count = node.refs.size();
    if (count > static_cast<std::size_t>(options.max_leaf_size)) return false;
    const float area = node.bounds.box.half_area();
    const float as_leaf = options.intersection_cost * area * static_cast<float>(count);
    return !(options.traversal_cost * area + options.intersection_cost * split_cost < as_leaf);
}

Halves split_objects(const NodeRange& node, const Binning& binning, const ObjectSplit& split,
                     int depth, const Parallel& parallel) {
    if (split.axis >= 0) {
        LaneBounds bounds[2];
        Reference* first = node.refs.data();
        Reference* last = first + node.refs.size();
        // Each is looked at once: where it goes and what bounds it there.
        for (;;) {
            const auto is_first = [&](const Reference& r) {
                return binning.bins(r).axis[split.axis] < split.bin;
            };
            for (; first != last && is_first(*first); ++first) bounds[0].extend(*first);
            for (; first != last && !is_first(last[-1]); --last) bounds[1].extend(last[-1]);
            if (first == last) break;
            std::swap(*first, last[-1]);
        }
        const auto count = static_cast<std::size_t>(first - node.refs.data());
        if (is_allowed(count, node.refs.size(), depth)) {
            return divide(node, count, bounds[0].node_bounds(), bounds[1].node_bounds());
        }
    }
    return divide(node, halve(node.refs, node.bounds.centroids), parallel);
}

}  // namespace packet
