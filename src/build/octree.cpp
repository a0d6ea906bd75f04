// A cell's references go to those of its eight parts that their triangles overlap, each cut down to
// the part. Nodes are boxes around what cells hold, so no space that is empty is ever in one; the
// cells only say where to cut.
//
// Meagher. Geometric modeling using octree encoding. Computer Graphics and Image Processing 1982.
// Glassner. Space subdivision for fast ray tracing. IEEE Computer Graphics and Applications 1984.
#include "build/octree.h"

#include "build/cell.h"
#include "build/clip.h"
#include "build/split.h"
#include "build/subtree.h"
#include "dispatch/dispatch.h"

#include <algorithm>
#include <array>
#include <bit>
#include <span>
#include <vector>

namespace packet {

namespace {

// Below this a task costs more than the work it moves to another core.
constexpr std::size_t kTaskSize = 4096;

/// Octant i of something is above the middle of axis a if bit a of i is set.
constexpr std::size_t kOctants = 8;
static_assert(kOctants == kWideSize);
constexpr unsigned kAbove[3] = {0b10101010, 0b11001100, 0b11110000};
/// Levels of the binary tree between a cell and its parts.
constexpr int kBinaryLevels = 3;

std::size_t first_octant(unsigned octants) {
    return static_cast<std::size_t>(std::countr_zero(octants));
}

struct OctreeCell : Cell {
    Bounds3f box;   ///< the cell itself, which is cut in its middle
    int level = 0;  ///< its sides are 2^-level of the root's
};

using Parts = std::array<OctreeCell, kOctants>;

/// The octants about `middle` that a box reaches into, bit i for octant i. What only touches a
/// plane is on one side of it.
unsigned octants_of(const Bounds3f& box, const glm::vec3& middle) {
    unsigned octants = 0xFF;
    for (int a = 0; a < 3; ++a) {
        if (box.upper[a] <= middle[a]) {
            octants &= ~kAbove[a];
        } else if (box.lower[a] >= middle[a]) {
            octants &= kAbove[a];
        }
    }
    return octants;
}

/// The part of a box in an octant that it reaches into.
Bounds3f part_of(const Bounds3f& box, std::size_t octant, const glm::vec3& middle) {
    Bounds3f part = box;
    for (int a = 0; a < 3; ++a) {
        if ((kAbove[a] >> octant & 1) != 0) {
            part.lower[a] = std::max(box.lower[a], middle[a]);
        } else {
            part.upper[a] = std::min(box.upper[a], middle[a]);
        }
    }
    return part;
}

/// Cuts the triangles of references at the middle of a cell.
class Cutter {
public:
    explicit Cutter(MeshView mesh) : mesh_(mesh) {}

    /// Adds to each part what of the reference is in there. No point of it is lost: where the box
    /// reaches into one part only there is nothing to cut, and else the overlap test is exact.
    void cut(const Reference& r, const glm::vec3& middle, std::array<Cell, kOctants>& parts) const {
        const Bounds3f box = r.bounds();
        unsigned octants = octants_of(box, middle);
        if (std::has_single_bit(octants)) return parts[first_octant(octants)].add(r);
        const glm::uvec3 t = mesh_.triangles[r.id];
        const glm::vec3 corners[3] = {mesh_.positions[t.x], mesh_.positions[t.y],
                                      mesh_.positions[t.z]};
        octants &= overlapped_octants(corners, box, middle);
        for (; octants != 0; octants &= octants - 1) {
            const std::size_t octant = first_octant(octants);
            const Bounds3f part = clip_triangle(corners, part_of(box, octant, middle));
            parts[octant].add({part.lower, r.id, part.upper});
        }
    }

private:
    /// Where the triangle overlaps the box's part; other octants' bits are of no use.
    [[nodiscard]] unsigned overlapped_octants(const glm::vec3 (&corners)[3], const Bounds3f& box,
                                              const glm::vec3& middle) const {
        float triangle[3][3], lower[3][32], upper[3][32];
        for (int a = 0; a < 3; ++a) {
            for (int k = 0; k < 3; ++k) triangle[k][a] = corners[k][a];
            for (std::size_t i = 0; i < kOctants; ++i) {
                const Bounds3f part = part_of(box, i, middle);
                lower[a][i] = part.lower[a];
                upper[a][i] = part.upper[a];
            }
        }
        return kernels_.overlap_axes(triangle, lower, upper, kOctants);
    }

    MeshView mesh_;
    const KernelTable& kernels_ = select_kernels({});
};

class Builder {
public:
    Builder(MeshView mesh, const BuildOptions& options, const Parallel& parallel)
        : cutter_(mesh), options_(options), parallel_(parallel) {}

    Hierarchy build(ScratchVector<Reference> references) const {
        if (references.empty()) return {};
        OctreeCell root;
        fill_root(root, std::move(references), options_, kMaxReferences);
        root.box = cube_around(root.bounds);
        Subtree tree;
        parallel_.run([&] { build_cell(std::move(root), tree); });
        return to_hierarchy(std::move(tree), parallel_);
    }

private:
    /// Appends the cell and all below it, and returns its node.
    std::uint32_t build_cell(OctreeCell cell, Subtree& out) const {
        const std::uint32_t node = add_node(cell.bounds, true, out);
        const std::size_t count = cell.references.size();
        if (count <= static_cast<std::size_t>(options_.max_leaf_size)) {
            out.fill_leaf(node, cell.references);
            return node;
        }
        Parts parts = divide(cell);
        share_out<OctreeCell>(cell, parts);
        cell = {};  // it would otherwise stay while all below is built
        if (count <= kTaskSize) {
            link(node, parts, out, [&](std::uint32_t parent, int side, OctreeCell& part) {
                const std::uint32_t child = build_cell(std::move(part), out);
                out.nodes[parent].child(side) = child;
            });
            return node;
        }
        // Its parent was as large, so this is the root of its subtree.
        PACKET_ASSERT(node == 0);
        std::vector<OctreeCell*> hanging;
        link(node, parts, out, [&](std::uint32_t parent, int side, OctreeCell& part) {
            out.hang(parent, side);
            hanging.push_back(&part);
        });
        parallel_.for_pieces(hanging.size(), 1, [&](std::size_t i, std::size_t) {
            build_task(std::move(*hanging[i]), *out.hanging[i].tree);
        });
        return node;
    }

    void build_task(OctreeCell cell, Subtree& out) const {
        const double work = cell.references.size() > kTaskSize ? 0.0 : cell.work;
        build_cell(std::move(cell), out);
        parallel_.advance(work);
    }

    /// Cubes make better cells than boxes of the scene's shape: in terrain, which is flat, with 13%
    /// less SAH cost.
    static Bounds3f cube_around(const Bounds3f& bounds) {
        const glm::vec3 extent = bounds.extent(), middle = bounds.center();
        const float half = 0.5f * std::max({extent.x, extent.y, extent.z});
        return {middle - half, middle + half};
    }

    static std::uint32_t add_node(const Bounds3f& bounds, bool is_wide_child, Subtree& out) {
        out.nodes.push_back({bounds});
        out.is_wide_child.push_back(is_wide_child);
        return static_cast<std::uint32_t>(out.nodes.size() - 1);
    }

    /// Makes parts, 2, 4 or 8 of which at least two hold something, descendants of the node.
    /// attach(parent, side, part) makes one a child of a node.
    template <class Attach>
    static void link(std::uint32_t node, std::span<OctreeCell> parts, Subtree& out,
                     const Attach& attach) {
        const std::size_t middle = parts.size() / 2;
        const std::span<OctreeCell> half[2] = {parts.first(middle), parts.last(middle)};
        if (count_held(half[0]) == 0) return link(node, half[1], out, attach);
        if (count_held(half[1]) == 0) return link(node, half[0], out, attach);
        for (int side = 0; side < 2; ++side) {
            if (count_held(half[side]) == 1) {
                attach(node, side, *std::find_if(half[side].begin(), half[side].end(), holds));
                continue;
            }
            Bounds3f bounds;
            for (const OctreeCell& part : half[side]) bounds.extend(part.bounds);
            const std::uint32_t child = add_node(bounds, false, out);
            out.nodes[node].child(side) = child;
            link(child, half[side], out, attach);
        }
    }

    static bool holds(const OctreeCell& part) { return !part.references.empty(); }
    static std::ptrdiff_t count_held(std::span<const OctreeCell> parts) {
        return std::count_if(parts.begin(), parts.end(), holds);
    }

    /// The parts to go on with. At least two of them hold something. May shrink the cell on the
    /// way.
    Parts divide(OctreeCell& cell) const {
        while (cell.level < options_.octree_levels) {
            const unsigned octants = octants_of(cell.bounds, cell.box.center());
            if (std::has_single_bit(octants)) {
                cell.box = part_of(cell.box, first_octant(octants), cell.box.center());
                ++cell.level;
                continue;
            }
            Parts parts = cut(cell);
            if (count_held(parts) == 1) {
                cell = std::move(*std::find_if(parts.begin(), parts.end(), holds));
                continue;
            }
            if (!pays(cell, parts)) break;
            return parts;
        }
        return deal(cell);
    }

    Parts cut(const OctreeCell& cell) const {
        const ScratchVector<Reference>& refs = cell.references;
        const glm::vec3 middle = cell.box.center();
        std::vector<std::array<Cell, kOctants>> pieces((refs.size() + kTaskSize - 1) / kTaskSize);
        parallel_.for_pieces(refs.size(), kTaskSize, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                cutter_.cut(refs[i], middle, pieces[begin / kTaskSize]);
            }
        });
        Parts parts;
        const std::size_t grain = pieces.size() == 1 ? kOctants : 1;
        parallel_.for_pieces(kOctants, grain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                for (std::array<Cell, kOctants>& piece : pieces) parts[i].append(piece[i]);
                parts[i].box = part_of(cell.box, i, middle);
                parts[i].level = cell.level + 1;
                parts[i].depth = cell.depth + kBinaryLevels;
            }
        });
        return parts;
    }

    /// Whether a ray is expected to meet fewer triangles than without the cut, which then is also
    /// allowed.
    [[nodiscard]] static bool pays(const OctreeCell& cell, const Parts& parts) {
        const auto cost = [](const Cell& c) {
            return static_cast<double>(c.bounds.half_area()) *
                   static_cast<double>(c.references.size());
        };
        double cost_of_parts = 0.0;
        std::size_t most = 0;
        for (const OctreeCell& part : parts) {
            cost_of_parts += cost(part);
            most = std::max(most, part.references.size());
        }
        return cost_of_parts < cost(cell) && is_within_spare<OctreeCell>(cell, parts) &&
               fits_depth(cell.depth + kBinaryLevels, most);
    }

    /// Halves the references three times, without regard to cells. The parts are never cut again.
    Parts deal(OctreeCell& cell) const {
        Parts parts;
        deal(cell.references, parts);
        for (OctreeCell& part : parts) {
            part.level = options_.octree_levels;
            part.depth = cell.depth + kBinaryLevels;
        }
        return parts;
    }
    void deal(ReferenceSpan refs, std::span<OctreeCell> parts) const {
        if (parts.size() == 1 || refs.size() <= static_cast<std::size_t>(options_.max_leaf_size)) {
            for (const Reference& r : refs) parts[0].add(r);
            return;
        }
        const std::size_t first = halve({refs, measure(refs, parallel_)});
        deal(refs.first(first), parts.first(parts.size() / 2));
        deal(refs.subspan(first), parts.last(parts.size() / 2));
    }

    Cutter cutter_;
    const BuildOptions& options_;
    const Parallel& parallel_;
};

}  // namespace

Hierarchy build_octree(MeshView mesh, ScratchVector<Reference> references,
                       const BuildOptions& options, const Parallel& parallel) {
    return Builder(mesh, options, parallel).build(std::move(references));
}

}  // namespace packet
