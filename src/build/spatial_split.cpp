// Finds the plane: slices of the node's box are filled with the parts of triangles in them, bounds
// of which are estimated in float.
#include "build/spatial_split.h"

#include "build/bin_sweep.h"
#include "build/lane_bounds.h"

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

/// A triangle, to estimate the bounds of its parts. Cutting references takes exact ones.
class SlicedTriangle {
public:
    SlicedTriangle(MeshView mesh, std::uint32_t id) {
        const glm::uvec3 t = mesh.triangles[id];
        for (int k = 0; k < 3; ++k) {
            corner_[k] = mesh.positions[t[k]];
            lanes_[k] = load_lanes(corner_[k]);
        }
    }
    /// Cuts `rest`, a box of a part of the triangle, at a plane: what is below is returned.
    [[nodiscard]] LaneBox cut_off(LaneBox& rest, int axis, float plane) const {
        LaneBox below, above;
        for (int k = 0; k < 3; ++k) {
            const int next = k == 2 ? 0 : k + 1;
            const float x = corner_[k][axis], y = corner_[next][axis];
            if (x <= plane) below.extend(lanes_[k], lanes_[k]);
            if (x >= plane) above.extend(lanes_[k], lanes_[k]);
            if ((x < plane && plane < y) || (y < plane && plane < x)) {
                const Lanes share((plane - x) / (y - x));
                const Lanes crossing = lanes_[k] + (lanes_[next] - lanes_[k]) * share;
                below.extend(crossing, crossing);
                above.extend(crossing, crossing);
            }
        }
        below = {xsimd::max(below.lower, rest.lower), xsimd::min(below.upper, rest.upper)};
        rest = {xsimd::max(above.lower, rest.lower), xsimd::min(above.upper, rest.upper)};
        return below;
    }

private:
    glm::vec3 corner_[3];
    Lanes lanes_[3];
};

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
        for (int a = 0; a < 3; ++a) {
            const int first = range.first.axis[a], last = range.last.axis[a];
            ++slice[first].first.axis[a];
            ++slice[last].last.axis[a];
            LaneBox rest = box;
            if (first != last) {
                const SlicedTriangle triangle(mesh, r.id);
                for (int i = first; i < last; ++i) {
                    slice[i].box[a].extend(triangle.cut_off(rest, a, slicing.plane(a, i + 1)));
                }
            }
            slice[last].box[a].extend(rest);
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
                                const Parallel& parallel) {
    const Slicing slicing(node.bounds.box);
    const auto slices = fold_references<Slices>(
        node.refs, parallel,
        [&](Slices& out, ReferenceSpan piece) {
            for (const Reference& r : piece) out.add(r, slicing, mesh);
        },
        [](Slices& a, const Slices& b) { a.add(b); });
    const Borders borders = find_borders(slices.slice, CountUnit(node.refs.size(), costs),
                                         static_cast<float>(node.capacity()));
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
        if (i < plane) best.count[0] += static_cast<float>(s.first.axis[best.axis]);
        if (i >= plane) best.count[1] += static_cast<float>(s.last.axis[best.axis]);
    }
    return best;
}

}  // namespace packet
