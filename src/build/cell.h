// A cell of space while it is cut up, and what its parts inherit: for builders that cut triangles
// along with space.
#pragma once

#include "build/references.h"
#include "core/macros.h"

#include <packet/accel.h>

#include <algorithm>
#include <cstddef>
#include <span>

namespace packet {

/// References are named by 31 bits; two values are kept for misses.
inline constexpr std::size_t kMaxReferences = (std::size_t{1} << 31) - 2;

struct Cell {
    ScratchVector<Reference> references;  ///< boxes of the parts of triangles in this cell
    Bounds3f bounds;                      ///< theirs: cells end where their contents do
    std::size_t spare = 0;                ///< how many references cuts in here may add
    double work = 1.0;                    ///< how much of the build it is
    int depth = 0;

    [[nodiscard]] std::size_t reference_count() const noexcept { return references.size(); }
    void add(const Reference& r) {
        references.push_back(r);
        bounds.extend(r.bounds());
    }
    void append(const Cell& other) {
        references.insert(references.end(), other.references.begin(), other.references.end());
        bounds.extend(other.bounds);
    }
};

/// How many references cuts may add to so many: they may make them options.max_reference_factor
/// times as many, up to `most`.
[[nodiscard]] inline std::size_t spare_of_root(std::size_t count, const BuildOptions& options,
                                               std::size_t most) {
    const double allowed =
        std::min(static_cast<double>(count) * static_cast<double>(options.max_reference_factor),
                 static_cast<double>(most));
    return static_cast<std::size_t>(allowed) - count;
}

/// Fills in a cell that holds everything.
inline void fill_root(Cell& root, ScratchVector<Reference> references, const BuildOptions& options,
                      std::size_t most) {
    root.spare = spare_of_root(references.size(), options, most);
    for (const Reference& r : references) root.bounds.extend(r.bounds());
    root.references = std::move(references);
}

/// Whether the parts of a cell have no more references together than they may.
template <class Child, class Parent>
[[nodiscard]] constexpr bool is_within_spare(const Parent& cell, std::span<const Child> children) {
    std::size_t count = 0;
    for (const Child& child : children) count += child.reference_count();
    return count <= cell.reference_count() + cell.spare;
}

/// Work, and the references that the cut has not used up, are shared in proportion to the parts'
/// references.
template <class Child, class Parent>
constexpr void share_out(const Parent& cell, std::span<Child> children) {
    PACKET_ASSERT(is_within_spare<Child>(cell, children));
    std::size_t count = 0;
    for (const Child& child : children) count += child.reference_count();
    const std::size_t left = cell.reference_count() + cell.spare - count;
    std::size_t rest = left;
    for (Child& child : children) {
        const double share = static_cast<double>(child.reference_count()) /
                             static_cast<double>(std::max<std::size_t>(count, 1));
        child.spare =
            &child == &children.back()
                ? rest
                : std::min(rest, static_cast<std::size_t>(share * static_cast<double>(left)));
        rest -= child.spare;
        child.work = share * cell.work;
    }
}

}  // namespace packet
