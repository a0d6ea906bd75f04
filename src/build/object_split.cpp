#include "build/object_split.h"

#include <algorithm>
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

std::size_t sample_step(std::size_t count, std::size_t fewest_samples) {
    constexpr std::size_t kLongestStep = 7;
    return std::min(count / fewest_samples | 1, kLongestStep);
}

namespace {

/// Aligned so that a bin's place is its number shifted.
struct alignas(64) Bin {
    LaneBox box[3];
    AxisCounts count;

    [[nodiscard]] const AxisCounts& begins() const { return count; }
    [[nodiscard]] const AxisCounts& ends() const { return count; }
};

struct Bins {
    Bin bin[kBinCount];

    void add(const Reference& r, const Binning& binning) {
        const LaneBox box = lane_box(r);
        const Binning::BinIds ids = binning.bins(centroid2_lanes(r));
        for (int a = 0; a < 3; ++a) {
            Bin& at = bin[static_cast<std::uint32_t>(ids.axis[a])];
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

/// Few references along each axis, by their centroids and then as they come.
struct Orders {
    std::uint8_t axis[3][kFewReferences];

    explicit Orders(ReferenceSpan refs) {
        const std::size_t count = refs.size();
        const Lanes zero(0.0f), one(1.0f);
        Lanes centroid[kFewReferences], rank[kFewReferences];
        for (std::size_t i = 0; i < count; ++i) {
            centroid[i] = centroid2_lanes(refs[i]);
            rank[i] = zero;
            for (std::size_t j = 0; j < i; ++j) {
                const Lanes is_after = xsimd::select(centroid[i] < centroid[j], one, zero);
                rank[j] += is_after;
                rank[i] += one - is_after;
            }
        }
        for (std::size_t i = 0; i < count; ++i) {
            alignas(16) std::int32_t place[4];
            xsimd::to_int(rank[i]).store_aligned(place);
            for (int a = 0; a < 3; ++a) axis[a][place[a]] = static_cast<std::uint8_t>(i);
        }
    }
};

/// Tries every place in the orders.
ObjectSplit split_few(ReferenceSpan refs, const CountUnit& unit) {
    const std::size_t count = refs.size();
    const Orders orders(refs);
    const auto extend = [&](LaneBox(&box)[3], std::size_t place) {
        for (int a = 0; a < 3; ++a) box[a].extend(lane_box(refs[orders.axis[a][place]]));
    };
    Lanes cost_above[kFewReferences];
    LaneBox above[3], below[3];
    for (std::size_t i = count - 1; i > 0; --i) {
        extend(above, i);
        cost_above[i] = half_areas(above) * unit.of(Lanes(static_cast<float>(count - i)));
    }
    alignas(16) float least[4], place[4];
    Lanes best(std::numeric_limits<float>::infinity()), best_place(0.0f);
    for (std::size_t i = 1; i < count; ++i) {
        extend(below, i - 1);
        const Lanes here(static_cast<float>(i));
        const Lanes cost = half_areas(below) * unit.of(here) + cost_above[i];
        const auto is_best = cost < best;
        best = xsimd::select(is_best, cost, best);
        best_place = xsimd::select(is_best, here, best_place);
    }
    best.store_aligned(least);
    best_place.store_aligned(place);
    ObjectSplit out;
    for (int a = 0; a < 3; ++a) {
        if (!(least[a] < out.cost)) continue;
        out.cost = least[a];
        out.axis = a;
        out.place = static_cast<int>(place[a]);
    }
    if (out.axis < 0) return out;
    std::copy_n(orders.axis[out.axis], count, out.order);
    LaneBox box[2];
    for (std::size_t i = 0; i < count; ++i) {
        box[i < static_cast<std::size_t>(out.place) ? 0 : 1].extend(lane_box(refs[out.order[i]]));
    }
    for (int side = 0; side < 2; ++side) out.bounds[side] = box[side].bounds();
    return out;
}

/// Sorts few references along the split's axis; yields how many go first.
std::size_t part_few(ReferenceSpan refs, const ObjectSplit& split) {
    Reference sorted[kFewReferences];
    for (std::size_t i = 0; i < refs.size(); ++i) sorted[i] = refs[split.order[i]];
    std::copy_n(sorted, refs.size(), refs.begin());
    return static_cast<std::size_t>(split.place);
}

[[nodiscard]] Bounds3f centroid_bounds(ReferenceSpan refs) {
    LaneBox out;
    for (const Reference& r : refs) {
        const Lanes c = centroid2_lanes(r);
        out.extend(c, c);
    }
    return out.bounds();
}

/// Sorts references by their bins; yields how many go first, and fills the bounds of each side.
/// Without branches: where a reference goes is anybody's guess.
std::size_t part_by_bins(ReferenceSpan refs, const ObjectSplit& split, const Parallel& parallel,
                         NodeBounds (&bounds)[2]) {
    std::size_t first = 0;
    for (std::size_t i = 0; i < refs.size(); ++i) {
        const Reference r = refs[i];
        const bool is_first = split.binning.bins(centroid2_lanes(r)).axis[split.axis] < split.place;
        refs[i] = refs[first];
        refs[first] = r;
        first += is_first ? 1 : 0;
    }
    const ReferenceSpan sides[2] = {refs.first(first), refs.subspan(first)};
    for (int side = 0; side < 2; ++side) {
        if (split.is_sampled) {
            bounds[side] = measure(sides[side], parallel);
            continue;
        }
        bounds[side].box = split.bounds[side];
        if (sides[side].size() > kFewReferences)
            bounds[side].centroids = centroid_bounds(sides[side]);
    }
    return first;
}

}  // namespace

ObjectSplit find_object_split(const NodeRange& node, const SahCosts& costs,
                              const Parallel& parallel, std::size_t fewest_samples) {
    const CountUnit unit(node.refs.size(), costs);
    if (node.refs.size() <= kFewReferences) return split_few(node.refs, unit);
    ObjectSplit best;
    const Binning& binning = best.binning = Binning(node.bounds.centroids);
    if (!binning.splits_any()) return best;
    const std::size_t step = sample_step(node.refs.size(), fewest_samples);
    best.is_sampled = step != 1;
    const Bins bins = fold_references<Bins>(
        node.refs, parallel,
        [&](Bins& out, ReferenceSpan piece) {
            for (std::size_t i = 0; i < piece.size(); i += step) out.add(piece[i], binning);
        },
        [](Bins& a, const Bins& b) { a.add(b); });
    const Borders borders = find_borders(bins.bin, unit, std::numeric_limits<float>::infinity());
    for (int a = 0; a < 3; ++a) {
        if (!binning.splits(a) || !(borders.cost[a] < best.cost)) continue;
        best.cost = borders.cost[a];
        best.axis = a;
        best.place = static_cast<int>(borders.bin[a]);
    }
    if (best.axis < 0) return best;
    best.bounds[0] = join_bins(bins.bin, best.axis, 0, best.place);
    best.bounds[1] = join_bins(bins.bin, best.axis, best.place, kBinCount);
    return best;
}

bool is_leaf(const NodeRange& node, float split_cost, const SahCosts& costs) {
    const std::size_t count = node.refs.size();
    if (count > costs.max_leaf_size) return false;
    const float area = node.bounds.box.half_area();
    const float as_leaf = costs.leaf(area, static_cast<std::uint32_t>(count));
    return !(costs.node * area + costs.block * split_cost < as_leaf);
}

bool is_surely_leaf(const NodeRange& node, const SahCosts& costs) {
    if (node.refs.size() > kFewReferences) return false;
    float least_cost = 0.0f;
    for (const Reference& r : node.refs) least_cost += r.bounds().half_area();
    return is_leaf(node, least_cost, costs);
}

Halves split_objects(const NodeRange& node, const ObjectSplit& split, int depth,
                     const Parallel& parallel) {
    if (split.axis >= 0) {
        NodeBounds bounds[2];
        std::size_t first = 0;
        if (node.refs.size() <= kFewReferences) {
            first = part_few(node.refs, split);
            for (int side = 0; side < 2; ++side) bounds[side].box = split.bounds[side];
        } else {
            first = part_by_bins(node.refs, split, parallel, bounds);
        }
        if (is_allowed(first, node.refs.size(), depth)) {
            return divide(node, first, bounds[0], bounds[1]);
        }
    }
    return divide(node, halve(node), parallel);
}

}  // namespace packet
