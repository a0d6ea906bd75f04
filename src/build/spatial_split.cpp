// Finds the plane: slices of the node's box are filled with the parts of triangles in them, bounds
// of which are estimated in float.
#include "build/spatial_split.h"

#include "build/bin_sweep.h"
#include "build/lane_bounds.h"
#include "build/object_split.h"

#include <bit>
#include <cmath>

namespace packet {

namespace {

/// Equal slices of a box along each axis. Axes too short to tell their planes apart have none.
class Slicing {
public:
    explicit Slicing(const Bounds3f& box) : lower_(box.lower), width_(0.0f) {
        glm::vec3 scale(0.0f);
        for (int a = 0; a < 3; ++a) {
            const float width = (box.upper[a] - box.lower[a]) / static_cast<float>(kBinCount);
            if (!std::isfinite(1.0f / width)) continue;
            width_[a] = width;
            scale[a] = 1.0f / width;
            if (!(box.lower[a] < plane(a, 1) && plane(a, kBinCount - 1) < box.upper[a])) {
                width_[a] = scale[a] = 0.0f;
            }
        }
        origin_ = load_lanes(lower_);
        widths_ = load_lanes(width_);
        scale_ = load_lanes(scale);
    }

    [[nodiscard]] bool slices(int axis) const { return width_[axis] > 0.0f; }
    /// The plane below slice i.
    [[nodiscard]] float plane(int axis, int i) const {
        return lower_[axis] + static_cast<float>(i) * width_[axis];
    }

    struct Range {
        AxisCounts first, last;
    };
    /// The slices that a reference's box reaches into; a plane that it only touches parts nothing.
    [[nodiscard]] Range range(const Reference& r) const {
        const LaneCounts most(kBinCount - 1), zero(0);
        const Lanes upper = upper_lanes(r);
        const LaneCounts first = xsimd::to_int((without_last(lower_lanes(r)) - origin_) * scale_);
        LaneCounts last = xsimd::to_int((upper - origin_) * scale_);
        const Lanes touched = origin_ + xsimd::to_float(last) * widths_;
        last = xsimd::to_int(xsimd::to_float(last) -
                             xsimd::select(upper <= touched, Lanes(1.0f), Lanes(0.0f)));
        Range out;
        const LaneCounts clamped = xsimd::min(xsimd::max(first, zero), most);
        clamped.store_aligned(out.first.axis);
        xsimd::min(xsimd::max(last, clamped), most).store_aligned(out.last.axis);
        return out;
    }

private:
    glm::vec3 lower_, width_;
    Lanes origin_, widths_, scale_;
};

/// A triangle's, as numbers and in lanes.
struct Corners {
    glm::vec3 at[3];
    Lanes lanes[3];

    Corners(MeshView mesh, std::uint32_t id) {
        const glm::uvec3 t = mesh.triangles[id];
        for (int k = 0; k < 3; ++k) {
            at[k] = mesh.positions[t[k]];
            lanes[k] = load_lanes(at[k]);
        }
    }
};

/// A triangle, to estimate the bounds of its parts between planes across an axis. Cutting
/// references takes exact ones. Without branches on where corners are, which nobody can guess.
class SlicedTriangle {
public:
    SlicedTriangle(const Corners& corners, int axis)
        : low_(corners.lanes[0]),
          middle_(corners.lanes[1]),
          low_at_(corners.at[0][axis]),
          middle_at_(corners.at[1][axis]),
          high_(corners.lanes[2]) {
        Lanes high_at(corners.at[2][axis]);
        order(low_, low_at_, middle_, middle_at_);
        order(middle_, middle_at_, high_, high_at);
        order(low_, low_at_, middle_, middle_at_);
        // Where two corners are at the same place, no plane comes between them to ask.
        longest_ = (high_ - low_) / (high_at - low_at_);
        lower_ = (middle_ - low_) / (middle_at_ - low_at_);
        upper_ = (high_ - middle_) / (high_at - middle_at_);
        start_at(low_, low_at_);
    }
    /// The part between the last plane and this one, both below the highest corner.
    [[nodiscard]] LaneBox cut_off(float plane) {
        const Lanes at(plane);
        LaneBox part = edge_;
        const Lanes passed =
            xsimd::select((edge_at_ <= middle_at_) & (middle_at_ <= at), middle_, edge_.lower);
        part.extend(passed, passed);
        const Lanes a = low_ + longest_ * (at - low_at_);
        const Lanes b = xsimd::select(middle_at_ < at, middle_ + upper_ * (at - middle_at_),
                                      low_ + lower_ * (at - low_at_));
        edge_ = {xsimd::min(a, b), xsimd::max(a, b)};
        edge_at_ = at;
        part.extend(edge_.lower, edge_.upper);
        return part;
    }
    /// What is above the last plane.
    [[nodiscard]] LaneBox rest() const {
        LaneBox part = edge_;
        const Lanes passed = xsimd::select(edge_at_ <= middle_at_, middle_, high_);
        part.extend(passed, passed);
        part.extend(high_, high_);
        return part;
    }

private:
    void start_at(const Lanes& corner, const Lanes& at) {
        edge_ = {corner, corner};
        edge_at_ = at;
    }
    static void order(Lanes& a, Lanes& a_at, Lanes& b, Lanes& b_at) {
        const auto is_ordered = a_at <= b_at;
        const Lanes first = xsimd::select(is_ordered, a, b), last = xsimd::select(is_ordered, b, a);
        const Lanes first_at = xsimd::min(a_at, b_at), last_at = xsimd::max(a_at, b_at);
        a = first, a_at = first_at, b = last, b_at = last_at;
    }

    Lanes low_, middle_;  ///< corners by the axis
    Lanes low_at_, middle_at_;
    Lanes high_;
    Lanes longest_, lower_, upper_;  ///< edges, for a unit of the axis
    LaneBox edge_;                   ///< of what the last plane cuts
    Lanes edge_at_;
};

LaneBox within(const LaneBox& part, const LaneBox& box) {
    return {xsimd::max(part.lower, box.lower), xsimd::min(part.upper, box.upper)};
}

struct Slice {
    LaneBox box[3];
    AxisCounts first, last;  ///< references that reach into this slice first, and last

    [[nodiscard]] const AxisCounts& begins() const { return first; }
    [[nodiscard]] const AxisCounts& ends() const { return last; }
};

struct Slices {
    Slice slice[kBinCount];

    void add(const Reference& r, const Slicing& slicing, MeshView mesh) {
        const Slicing::Range range = slicing.range(r);
        const LaneBox box = lane_box(r);
        std::uint32_t cut_axes = 0;
        for (int a = 0; a < 3; ++a) {
            const auto first = range.first.axis[a], last = range.last.axis[a];
            ++slice[first].first.axis[a];
            ++slice[last].last.axis[a];
            if (first != last) {
                cut_axes |= 1u << a;
            } else {
                slice[last].box[a].extend(box.lower, box.upper);
            }
        }
        if (cut_axes == 0) return;
        const Corners corners(mesh, r.id);
        for (; cut_axes != 0; cut_axes &= cut_axes - 1) {
            const int a = std::countr_zero(cut_axes);
            SlicedTriangle triangle(corners, a);
            const int first = range.first.axis[a], last = range.last.axis[a];
            for (int i = first; i < last; ++i) {
                slice[i].box[a].extend(within(triangle.cut_off(slicing.plane(a, i + 1)), box));
            }
            slice[last].box[a].extend(within(triangle.rest(), box));
        }
    }
    void add(const Slices& other) {
        for (int i = 0; i < kBinCount; ++i) {
            for (int a = 0; a < 3; ++a) slice[i].box[a].extend(other.slice[i].box[a]);
            slice[i].first.add(other.slice[i].first);
            slice[i].last.add(other.slice[i].last);
        }
    }
};

}  // namespace

SpatialSplit find_spatial_split(MeshView mesh, const NodeRange& node, const SahCosts& costs,
                                const Parallel& parallel, std::size_t fewest_samples) {
    const Slicing slicing(node.bounds.box);
    const std::size_t step = sample_step(node.refs.size(), fewest_samples);
    const auto scale = static_cast<float>(step);
    const auto slices = fold_references<Slices>(
        node.refs, parallel,
        [&](Slices& out, ReferenceSpan piece) {
            for (std::size_t i = 0; i < piece.size(); i += step) out.add(piece[i], slicing, mesh);
        },
        [](Slices& a, const Slices& b) { a.add(b); });
    const Borders borders = find_borders(slices.slice, CountUnit(node.refs.size(), costs),
                                         static_cast<float>(node.capacity()) / scale);
    SpatialSplit best;
    int plane = 0;
    for (int a = 0; a < 3; ++a) {
        if (!slicing.slices(a) || !(borders.cost[a] < best.cost)) continue;
        plane = static_cast<int>(borders.bin[a]);
        best.cost = borders.cost[a];
        best.axis = a;
        best.position = slicing.plane(a, plane);
    }
    if (best.axis < 0) return best;
    best.bounds[0] = join_bins(slices.slice, best.axis, 0, plane);
    best.bounds[1] = join_bins(slices.slice, best.axis, plane, kBinCount);
    for (int i = 0; i < kBinCount; ++i) {
        const Slice& s = slices.slice[i];
        if (i < plane) best.count[0] += scale * static_cast<float>(s.first.axis[best.axis]);
        if (i >= plane) best.count[1] += scale * static_cast<float>(s.last.axis[best.axis]);
    }
    return best;
}

}  // namespace packet
