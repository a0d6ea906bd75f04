#include "build/kd_events.h"

#include "schedule/radix_sort.h"

#include <algorithm>
#include <bit>

namespace packet {

namespace {

// Below this a task costs more than the work it moves to another core.
constexpr std::size_t kTaskSize = 4096;
// References: about a millisecond of work.
constexpr std::size_t kCheckInterval = 65536;

// An event is a number that sorts by position, then kind, then reference: 32, 2 and 30 bits. At one
// position boxes end before others begin, so that boxes that merely touch do not overlap.
using Event = std::uint64_t;
enum Kind : std::uint32_t { kEnd, kFlat, kBegin };

/// Bits that sort as the floats do. -0 is 0: to a plane they are the same place.
std::uint32_t sortable(float x) {
    const auto bits = std::bit_cast<std::uint32_t>(x + 0.0f);
    return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
}

Event make_event(float position, Kind kind, std::size_t reference) {
    return Event{sortable(position)} << 32 | Event{kind} << 30 | Event{reference};
}

float position_of(Event event) {
    const auto bits = static_cast<std::uint32_t>(event >> 32);
    return std::bit_cast<float>((bits & 0x80000000u) != 0 ? bits & 0x7FFFFFFFu : ~bits);
}

Kind kind_of(Event event) { return static_cast<Kind>(event >> 30 & 3); }
std::size_t reference_of(Event event) { return event & (kMaxEventReferences - 1); }
Event with_reference(Event event, std::size_t reference) {
    return (event & ~Event{kMaxEventReferences - 1}) | Event{reference};
}

/// Sorts events whose references ascend.
void sort_events(EventList& events, const Parallel& parallel) {
    // Up to here comparing is faster than five passes over digits.
    constexpr std::size_t kMostCompared = 20000;
    if (events.size() <= kMostCompared) return std::sort(events.begin(), events.end());
    // A stable sort keeps references in order: it need not look at their bits.
    EventList scratch(events.size());
    const std::span<Event> sorted =
        radix_sort<Event>(events, scratch, 34, parallel, [](Event event) { return event >> 30; });
    if (sorted.data() == scratch.data()) events = std::move(scratch);
}

/// The sorted events of references `first` and after.
EventList sorted_events(const ScratchVector<Reference>& references, std::size_t first, int axis,
                        const Parallel& parallel) {
    EventList events;
    events.reserve(2 * (references.size() - first));
    for (std::size_t i = first; i < references.size(); ++i) {
        if (i % kCheckInterval == 0) parallel.check();
        const Reference& r = references[i];
        if (r.lower[axis] == r.upper[axis]) {
            events.push_back(make_event(r.lower[axis], kFlat, i));
        } else {
            events.push_back(make_event(r.lower[axis], kBegin, i));
            events.push_back(make_event(r.upper[axis], kEnd, i));
        }
    }
    sort_events(events, parallel);
    return events;
}

/// fn(axis) for the three axes, side by side if there is enough to do.
template <class Fn>
void for_axes(std::size_t work, const Parallel& parallel, Fn fn) {
    parallel.for_pieces(3, work > kTaskSize ? 1 : 3, [&](std::size_t begin, std::size_t end) {
        for (std::size_t a = begin; a < end; ++a) fn(static_cast<int>(a));
    });
}

/// How many events of each kind are at one position.
struct Group {
    float position;
    std::size_t count[3] = {0, 0, 0};
    std::size_t next;  ///< the first event behind

    Group(const EventList& events, std::size_t first)
        : position(position_of(events[first])), next(first) {
        const Event end = (events[first] >> 32) + 1;
        for (; next < events.size() && events[next] >> 32 < end; ++next) {
            ++count[kind_of(events[next])];
        }
    }
};

/// Moves a plane along the axis past all events and keeps the cheapest place.
void sweep(const KdCell& cell, int axis, KdSearch<KdCell>& search) {
    const EventList& events = cell.events[static_cast<std::size_t>(axis)];
    const auto consider = [&](float end, float begin, const KdCounts& counts, int flat_side) {
        search.consider(axis, end, end, begin, counts, flat_side);
    };
    std::size_t below = 0, above = cell.references.size();
    for (std::size_t i = 0; i < events.size();) {
        const Group here(events, i);
        i = here.next;
        above -= here.count[kEnd] + here.count[kFlat];
        const std::size_t flat = here.count[kFlat];
        // Nothing lies between a plane that cuts nothing and where the next box begins. Wald and
        // Havran reward empty space by a constant; here the cells end where their contents do, so
        // it is known what it is worth.
        const bool is_gap = below + flat + above == cell.references.size() &&
                            here.count[kBegin] == 0 && i < events.size();
        const float begin = is_gap ? position_of(events[i]) : here.position;
        consider(here.position, begin, {{below + flat, above}}, 0);
        if (flat != 0) consider(here.position, here.position, {{below, above + flat}}, 1);
        below += flat + here.count[kBegin];
    }
}

/// The child's events: those of its whole references from the parent's list, which stays in order
/// as the references did, merged with those of the parts.
EventList child_events(const EventList& parent, const KdChildren& children, std::size_t side,
                       int axis, const Parallel& parallel) {
    parallel.check();
    const ScratchVector<Reference>& references = children.cell[side].references;
    const EventList parts = sorted_events(references, children.whole[side], axis, parallel);
    EventList out;
    out.reserve(2 * references.size());
    auto part = parts.begin();
    for (const Event event : parent) {
        const KdPlace place = children.places[reference_of(event)];
        if (place == kCut || (place & 1) != side) continue;
        const Event moved = with_reference(event, place / 2);
        while (part != parts.end() && *part < moved) out.push_back(*part++);
        out.push_back(moved);
    }
    out.insert(out.end(), part, parts.end());
    return out;
}

}  // namespace

EventLists make_events(const ScratchVector<Reference>& references, const Parallel& parallel) {
    EventLists lists;
    for_axes(references.size(), parallel, [&](int a) {
        lists[static_cast<std::size_t>(a)] = sorted_events(references, 0, a, parallel);
    });
    return lists;
}

KdPlane find_cheapest_plane(const KdCell& cell, const BuildOptions& options,
                            const Parallel& parallel) {
    const KdCost cost(cell, options);
    std::array<KdPlane, 3> planes;
    for_axes(cell.references.size(), parallel, [&](int a) {
        KdSearch<KdCell> search(cell, cost);
        sweep(cell, a, search);
        planes[static_cast<std::size_t>(a)] = search.best;
    });
    return *std::min_element(planes.begin(), planes.end(),
                             [](const KdPlane& a, const KdPlane& b) { return a.cost < b.cost; });
}

void split_events(const EventLists& parent, KdChildren& children, const Parallel& parallel) {
    for_axes(children.places.size(), parallel, [&](int a) {
        const auto axis = static_cast<std::size_t>(a);
        for (std::size_t side = 0; side < 2; ++side) {
            children.cell[side].events[axis] =
                child_events(parent[axis], children, side, a, parallel);
        }
    });
}

}  // namespace packet
