#include "build/references.h"

#include "scene/triangle_fault.h"

#include <algorithm>
#include <vector>

namespace packet {

/// Triangles are classified in pieces; what a piece keeps is moved to its place once all are
/// counted.
struct Piece {
    std::size_t kept = 0;
    Bounds3f bounds;
    SkippedTriangles skipped;
};

static constexpr std::size_t kGrain = 16384;

static Piece collect_piece(MeshView mesh, std::size_t begin, std::size_t end, Reference* out) {
    Piece piece;
    for (std::size_t i = begin; i < end; ++i) {
        const glm::uvec3 triangle = mesh.triangles[i];
        const glm::vec3& v0 = mesh.positions[triangle.x];
        const glm::vec3& v1 = mesh.positions[triangle.y];
        const glm::vec3& v2 = mesh.positions[triangle.z];
        const TriangleFault fault = find_fault(v0, v1, v2);
        if (fault != TriangleFault::kNone) {
            add_fault(piece.skipped, fault);
            continue;
        }
        Bounds3f box{v0, v0};
        box.extend(v1);
        box.extend(v2);
        piece.bounds.extend(box);
        out[piece.kept++] = {box.lower, static_cast<std::uint32_t>(i), box.upper};
    }
    return piece;
}

ScratchVector<std::uint32_t> ids_of(std::span<const Reference> references,
                                    const Parallel& parallel) {
    ScratchVector<std::uint32_t> out(references.size());
    parallel.for_pieces(references.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) out[i] = references[i].id;
    });
    return out;
}

References collect_references(MeshView mesh, const Parallel& parallel) {
    const std::size_t count = mesh.triangles.size();
    References out;
    // Behind them is room for what cutting triangles may add. What is left of it is never written,
    // so it takes addresses, no memory; and blocks of triangles fit in here later on, which take
    // some 40 to 55 bytes for each of these.
    out.items.reserve(2 * count);
    out.items.resize(count);
    std::vector<Piece> pieces((count + kGrain - 1) / kGrain);
    parallel.for_pieces(count, kGrain, [&](std::size_t begin, std::size_t end) {
        pieces[begin / kGrain] = collect_piece(mesh, begin, end, out.items.data() + begin);
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        const auto first = out.items.begin() + static_cast<std::ptrdiff_t>(i * kGrain);
        if (kept != i * kGrain) {
            std::copy(first, first + static_cast<std::ptrdiff_t>(pieces[i].kept),
                      out.items.begin() + static_cast<std::ptrdiff_t>(kept));
        }
        kept += pieces[i].kept;
        out.bounds.extend(pieces[i].bounds);
        out.skipped.non_finite += pieces[i].skipped.non_finite;
        out.skipped.too_large += pieces[i].skipped.too_large;
        out.skipped.zero_area += pieces[i].skipped.zero_area;
    }
    out.items.resize(kept);
    return out;
}

}  // namespace packet
