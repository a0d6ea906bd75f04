// Rays in memory become columns, and columns of hits become rows in memory. Of an image, or without
// an order, four rays and more follow each other: so do their hits, which then are stored as one
// row of numbers.
#pragma once

#include "kernels/best_hit.h"
#include "kernels/kernel_table.h"
#include "kernels/lanes.h"
#include "kernels/transpose.h"

namespace packet {

/// Rays transposed: one array a component, in the order of Ray's members. (RayPacket itself has
/// constructors, and a copy of those compiled for this ISA must not end up in the library.)
template <int kCount, class Isa>
struct RayArrays {
    alignas(64) float component[8][kCount];
};

/// Where the components of rays lie.
struct RayColumns {
    const float* component[8];

    PACKET_INLINE RayColumns from(int lane) const {
        RayColumns out;
        for (int i = 0; i < 8; ++i) out.component[i] = component[i] + lane;
        return out;
    }
};

/// Hits transposed. A miss has t = inf and ids of -1.
template <int kCount, class Isa>
struct HitArrays {
    alignas(64) float t[kCount];
    float u[kCount], v[kCount];
    std::int32_t prim_id[kCount], instance_id[kCount];
};

/// The mesh is looked up last: an instance's mesh never changes.
PACKET_INLINE std::uint32_t mesh_of(const SceneView& scene, std::int32_t instance_id) {
    return instance_id < 0 ? kInvalidId : scene.mesh_of_instance[instance_id];
}

/// The meshes of eight instances, to be read as one row. Where all are written as one, that need
/// not wait for them.
template <class Isa>
PACKET_INLINE void meshes_of(const SceneView& scene, const std::int32_t* instance_id,
                             std::int32_t (&out)[8]) {
    using I = Int<8, Isa>;
    if (scene.is_single_mesh) {
        const auto mesh_id =
            static_cast<std::int32_t>(scene.mesh_of_instance[scene.instances[0].instance_id]);
        select(I::load(instance_id) < I(0), I(-1), I(mesh_id)).store(out);
    } else {
        for (int i = 0; i < 8; ++i)
            out[i] = static_cast<std::int32_t>(mesh_of(scene, instance_id[i]));
    }
}

/// Where ray i of the batch lies, and its result.
PACKET_INLINE std::size_t place(const TraceBatch& batch, std::size_t i) {
    if (batch.order == nullptr) return i;
    const std::size_t row = i >> batch.row_bits;
    return batch.order[row] + (i - (row << batch.row_bits));
}

/// Where eight rays lie of which four and four follow each other.
struct RowPair {
    std::size_t first, second;

    /// Whether the batch's rays lie so from any multiple of four on.
    PACKET_INLINE static bool are_all(const TraceBatch& batch) {
        return batch.order == nullptr || batch.row_bits == 2;
    }
    PACKET_INLINE RowPair(const std::uint32_t* order, std::size_t begin) {
        first = order != nullptr ? order[begin / 4] : begin;
        second = order != nullptr ? order[begin / 4 + 1] : begin + 4;
    }
    PACKET_INLINE std::size_t operator[](std::size_t i) const {
        return i < 4 ? first + i : second + (i - 4);
    }
};
/// Where eight rays lie, in any order.
struct Places {
    const TraceBatch& batch;
    std::size_t begin;

    PACKET_INLINE std::size_t operator[](std::size_t i) const { return place(batch, begin + i); }
};

/// Fetches rays `begin` to `begin + count`, as far as there are so many, and the lines of their
/// hits, while those before them are traced: in a sorted order or an image's no hardware foresees
/// them.
PACKET_INLINE void prefetch_rays(const TraceBatch& batch, std::size_t begin, std::size_t count) {
    const std::size_t end = batch.count - begin < count ? batch.count : begin + count;
    if (RowPair::are_all(batch)) {
        // What ends in one line more begins another row's.
        for (std::size_t i = begin; i < end; i += 4) {
            const std::size_t at = batch.order != nullptr ? batch.order[i / 4] : i;
            __builtin_prefetch(batch.rays + at);
            __builtin_prefetch(batch.rays + at + 2);
            if (batch.hits == nullptr) continue;
            __builtin_prefetch(batch.hits + at, 1);
            __builtin_prefetch(batch.hits + at + 3, 1);
        }
        return;
    }
    for (std::size_t i = begin; i < end; ++i) {
        const std::size_t at = place(batch, i);
        __builtin_prefetch(batch.rays + at);
        if (batch.hits != nullptr) __builtin_prefetch(batch.hits + at, 1);
    }
}

/// Eight rays become columns: a ray has as many numbers.
template <int kCount, class Isa, class Where>
PACKET_INLINE void gather_8_rays(const Ray* rays, const Where& where, RayArrays<kCount, Isa>& out,
                                 int first) {
    static_assert(sizeof(Ray) == 8 * sizeof(float));
    const float* rows[8];
    for (std::size_t i = 0; i < 8; ++i) {
        rows[i] = reinterpret_cast<const float*>(rays + where[i]);
    }
    Floats8 columns[8];
    transpose(rows, columns);
    for (int i = 0; i < 8; ++i) *as_row(out.component[i] + first) = columns[i];
}

template <int kCount, class Isa>
PACKET_INLINE RayColumns gather_rays(const TraceBatch& batch, std::size_t begin, int count,
                                     RayArrays<kCount, Isa>& out) {
    const std::uint32_t* const order = batch.order;
    const Ray* const all = batch.rays;
    int i = 0;
    if (RowPair::are_all(batch) && begin % 4 == 0) {
        for (; i + 8 <= count; i += 8) {
            const RowPair rows(order, begin + static_cast<std::size_t>(i));
            gather_8_rays(all, rows, out, i);
        }
    }
    for (; i + 8 <= count; i += 8) {
        const Places places{batch, begin + static_cast<std::size_t>(i)};
        gather_8_rays(batch.rays, places, out, i);
    }
    for (; i < count; ++i) {
        const Ray& ray = batch.rays[place(batch, begin + static_cast<std::size_t>(i))];
        out.component[0][i] = ray.org.x, out.component[1][i] = ray.org.y;
        out.component[2][i] = ray.org.z, out.component[3][i] = ray.tnear;
        out.component[4][i] = ray.dir.x, out.component[5][i] = ray.dir.y;
        out.component[6][i] = ray.dir.z, out.component[7][i] = ray.tfar;
    }
    RayColumns columns;
    for (int c = 0; c < 8; ++c) columns.component[c] = out.component[c];
    return columns;
}

template <int kCount, class Isa>
PACKET_INLINE void scatter_hit(const SceneView& scene, const HitArrays<kCount, Isa>& hits, int i,
                               Hit& out) {
    out.t = hits.t[i], out.u = hits.u[i], out.v = hits.v[i];
    out.prim_id = static_cast<std::uint32_t>(hits.prim_id[i]);
    out.mesh_id = mesh_of(scene, hits.instance_id[i]);
    out.instance_id = static_cast<std::uint32_t>(hits.instance_id[i]);
}

/// The columns of eight hits.
template <int kCount, class Isa>
struct HitColumns {
    std::int32_t mesh_id[8];
    const float* column[6];  ///< in the order of Hit's members

    HitColumns(const HitColumns&) = delete;
    HitColumns& operator=(const HitColumns&) = delete;
    PACKET_INLINE HitColumns(const SceneView& scene, const HitArrays<kCount, Isa>& hits,
                             int first) {
        static_assert(sizeof(Hit) == sizeof column / sizeof *column * sizeof(float));
        meshes_of<Isa>(scene, hits.instance_id + first, mesh_id);
        column[0] = hits.t + first, column[1] = hits.u + first, column[2] = hits.v + first;
        column[3] = reinterpret_cast<const float*>(hits.prim_id + first);
        column[4] = reinterpret_cast<const float*>(mesh_id);
        column[5] = reinterpret_cast<const float*>(hits.instance_id + first);
    }
};

/// Eight hits become rows of six numbers.
template <int kCount, class Isa>
PACKET_INLINE void scatter_8_hits(const TraceBatch& batch, std::size_t begin,
                                  const HitArrays<kCount, Isa>& hits, int first) {
    const HitColumns<kCount, Isa> from(*batch.scene, hits, first);
    const auto& column = from.column;
    const float* const columns[8] = {column[0], column[1], column[2], column[3],
                                     column[4], column[5], column[5], column[5]};
    Floats8 rows[8];  // whose last two numbers are not stored
    transpose(columns, rows);
    for (std::size_t i = 0; i < 8; ++i) store6(&batch.hits[place(batch, begin + i)], rows[i]);
}
/// Those of four and four rays that follow each other.
template <int kCount, class Isa>
PACKET_INLINE void scatter_8_hits(const SceneView& scene, const RowPair& rows,
                                  const HitArrays<kCount, Isa>& hits, int first, Hit* out) {
    const HitColumns<kCount, Isa> from(scene, hits, first);
    Floats8 numbers[6];
    interleave(from.column, numbers);
    auto* const one = reinterpret_cast<float*>(out + rows.first);
    auto* const other = reinterpret_cast<float*>(out + rows.second);
    for (int i = 0; i < 6; ++i) store_halves(one + 4 * i, other + 4 * i, numbers[i]);
}

template <Query query, int kCount, class Isa>
PACKET_INLINE void scatter_hits(const TraceBatch& batch, std::size_t begin, int count,
                                const HitArrays<kCount, Isa>& hits) {
    int i = 0;
    if constexpr (query == Query::kClosest) {
        if (RowPair::are_all(batch) && begin % 4 == 0) {
            const std::uint32_t* const order = batch.order;
            for (; i + 8 <= count; i += 8) {
                const RowPair rows(order, begin + static_cast<std::size_t>(i));
                scatter_8_hits(*batch.scene, rows, hits, i, batch.hits);
            }
        }
        for (; i + 8 <= count; i += 8) {
            scatter_8_hits(batch, begin + static_cast<std::size_t>(i), hits, i);
        }
    }
    for (; i < count; ++i) {
        const std::size_t at = place(batch, begin + static_cast<std::size_t>(i));
        if constexpr (query == Query::kAny) {
            batch.occluded[at] = hits.prim_id[i] >= 0;
        } else {
            scatter_hit(*batch.scene, hits, i, batch.hits[at]);
        }
    }
}

}  // namespace packet
