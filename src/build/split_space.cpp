// Parts a node at a plane, in place: references on one side are sorted to it, and those that reach
// to both are cut, unless it costs less that one side grows around them.
#include "build/clip.h"
#include "build/lane_bounds.h"
#include "build/spatial_split.h"

#include <algorithm>
#include <vector>

namespace packet {

namespace {

float area_times(const Bounds3f& box, float count) { return box.half_area() * count; }

enum class Side { kBelow, kAbove, kBoth };

/// Deals out what reaches to both sides of a plane.
class Dealer {
public:
    Dealer(MeshView mesh, const SpatialSplit& split, std::size_t room)
        : mesh_(mesh), split_(split), room_(room) {}

    /// The parts of a reference; one is empty if it goes to one side.
    [[nodiscard]] CutReference deal(const Reference& r) {
        const Side side = choose(r);
        CutReference out = {{r, r}};
        if (side == Side::kBoth) {
            out = cut_reference(mesh_, r, split_.axis, split_.position);
        } else {
            const Bounds3f none;
            Reference& other = out.side[side == Side::kBelow ? 1 : 0];
            other.lower = none.lower;
            other.upper = none.upper;
        }
        if (!out.side[0].bounds().empty() && !out.side[1].bounds().empty()) --room_;
        return out;
    }

private:
    /// The side that costs least, after what was dealt before.
    [[nodiscard]] Side choose(const Reference& r) {
        Bounds3f(&box)[2] = split_.bounds;
        float(&count)[2] = split_.count;
        Bounds3f grown[2] = {box[0], box[1]};
        grown[0].extend(r.bounds());
        grown[1].extend(r.bounds());
        const float cut = room_ == 0 ? std::numeric_limits<float>::infinity()
                                     : area_times(box[0], count[0]) + area_times(box[1], count[1]);
        const float below = area_times(grown[0], count[0]) + area_times(box[1], count[1] - 1.0f);
        const float above = area_times(box[0], count[0] - 1.0f) + area_times(grown[1], count[1]);
        if (cut <= below && cut <= above) return Side::kBoth;
        const std::size_t side = below <= above ? 0 : 1;
        box[side] = grown[side];
        count[1 - side] -= 1.0f;
        return side == 0 ? Side::kBelow : Side::kAbove;
    }

    MeshView mesh_;
    SpatialSplit split_;
    std::size_t room_;
};

/// References in the order below, both, above a plane.
struct ThreeWays {
    Reference* both;   ///< the first that reaches to both sides
    Reference* above;  ///< the first above
    LaneBounds bounds[2];
};

ThreeWays part_three_ways(ReferenceSpan refs, int axis, float position) {
    Reference* const begin = refs.data();
    ThreeWays out{begin, begin + refs.size(), {}};
    for (Reference* r = begin; r != out.above;) {
        if (r->lower[axis] >= position) {
            out.bounds[1].extend(*r);
            std::swap(*r, *--out.above);
        } else if (r->upper[axis] <= position) {
            out.bounds[0].extend(*r);
            std::swap(*r++, *out.both++);
        } else {
            ++r;
        }
    }
    return out;
}

/// Makes room between `begin` and `end`, or behind `end`, one list: moves as few as it must.
void close_gap(Reference* gap, Reference* begin, Reference* end,
               const std::vector<Reference>& more) {
    const auto width = static_cast<std::size_t>(begin - gap);
    const std::size_t filled = std::min(width, more.size());
    const auto middle = more.begin() + static_cast<std::ptrdiff_t>(filled);
    std::copy(more.begin(), middle, gap);
    std::copy(middle, more.end(), end);
    const std::size_t moved = std::min(width - filled, static_cast<std::size_t>(end - begin));
    std::copy_n(end - moved, moved, gap + filled);
}

}  // namespace

std::optional<Halves> split_space(MeshView mesh, const NodeRange& node, const SpatialSplit& split,
                                  int depth, const Parallel& parallel) {
    constexpr std::ptrdiff_t kCheckInterval = 1024;  // cuts: about a millisecond
    ThreeWays ways = part_three_ways(node.refs, split.axis, split.position);
    Reference* const begin = node.refs.data();
    Reference* const end = begin + node.refs.size();
    if (!fits_depth(depth + 1,
                    static_cast<std::size_t>(std::max(ways.above - begin, end - ways.both)))) {
        return {};
    }
    Dealer dealer(mesh, split, node.room);
    Reference* below_end = ways.both;
    std::vector<Reference> above;
    for (Reference* r = ways.both; r != ways.above; ++r) {
        if ((r - ways.both) % kCheckInterval == 0) parallel.check();
        const CutReference parts = dealer.deal(*r);
        if (!parts.side[0].bounds().empty()) {
            ways.bounds[0].extend(parts.side[0]);
            *below_end++ = parts.side[0];
        }
        if (!parts.side[1].bounds().empty()) {
            ways.bounds[1].extend(parts.side[1]);
            above.push_back(parts.side[1]);
        }
    }
    const auto first = static_cast<std::size_t>(below_end - begin);
    const std::size_t count = first + above.size() + static_cast<std::size_t>(end - ways.above);
    close_gap(below_end, ways.above, end, above);
    NodeRange all{{begin, count}, ways.bounds[0].node_bounds(), node.capacity() - count};
    const NodeBounds bounds[2] = {ways.bounds[0].node_bounds(), ways.bounds[1].node_bounds()};
    if (is_allowed(first, count, depth)) return divide(all, first, bounds[0], bounds[1]);
    // What the plane seemed to part is all on one side, where nothing was cut.
    all.bounds.extend(bounds[1]);
    return divide(all, halve(all), parallel);
}

}  // namespace packet
