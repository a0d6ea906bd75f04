// A ray's key has 5 bits of each of its six coordinates, where it starts and where it goes, in
// turn: the highest bits are those of the direction, which are its octant.
#include "ray_sort.h"

#include "radix_sort.h"

#include <cmath>
#include <cstdint>

namespace packet::cuda {

namespace {

constexpr unsigned kBlockThreads = 256;
constexpr int kBitsPerCoordinate = 5;
constexpr int kKeyBits = 6 * kBitsPerCoordinate;

/// The cells that origins are counted in.
struct OriginGrid {
    float lower[3], cells_per_unit[3];

    explicit OriginGrid(const Bounds3f& world) {
        for (int a = 0; a < 3; ++a) {
            lower[a] = world.lower[a];
            const float scale = (1 << kBitsPerCoordinate) / (world.upper[a] - world.lower[a]);
            cells_per_unit[a] = std::isfinite(scale) ? scale : 0.0f;
        }
    }
};

/// The cell of a coordinate in units of cells; the nearest if it lies beyond, the first for NaN.
PACKET_DEVICE std::uint32_t cell(float x) {
    constexpr float kLast = (1 << kBitsPerCoordinate) - 1;
    return x > 0.0f ? static_cast<std::uint32_t>(x < kLast ? x : kLast) : 0u;
}

/// Moves bit i of the low 5 to bit 6i.
PACKET_DEVICE std::uint32_t spread_5_bits(std::uint32_t x) {
    return (x & 1u) | (x & 2u) << 5 | (x & 4u) << 10 | (x & 8u) << 15 | (x & 16u) << 20;
}

PACKET_DEVICE std::uint32_t sort_key(const Ray& ray, const OriginGrid& grid) {
    const float length = fabsf(ray.dir.x) + fabsf(ray.dir.y) + fabsf(ray.dir.z);
    constexpr float kHalf = 1 << (kBitsPerCoordinate - 1);
    std::uint32_t key = 0;
    for (int a = 0; a < 3; ++a) {
        const float org = (ray.org[a] - grid.lower[a]) * grid.cells_per_unit[a];
        const float dir = (ray.dir[a] / length + 1.0f) * kHalf;
        key |= spread_5_bits(cell(dir)) << (3 + a) | spread_5_bits(cell(org)) << a;
    }
    return key;
}

__global__ void fill_keys(const Ray* rays, std::uint32_t count, OriginGrid grid,
                          std::uint32_t* keys, std::uint32_t* values) {
    const unsigned i = thread_in_grid();
    if (i >= count) return;
    keys[i] = sort_key(rays[i], grid);
    values[i] = i;
}

}  // namespace

DeviceArray<std::uint32_t> sort_rays(const Ray* rays, std::uint32_t count, const Bounds3f& world,
                                     cudaStream_t stream) {
    SortedPairs<std::uint32_t> pairs{DeviceArray<std::uint32_t>(count),
                                     DeviceArray<std::uint32_t>(count)};
    launch(fill_keys, {(count + kBlockThreads - 1) / kBlockThreads, kBlockThreads, 0, stream}, rays,
           count, OriginGrid(world), pairs.keys.data(), pairs.values.data());
    check(cudaGetLastError(), "launch of fill_keys");
    return radix_sort(std::move(pairs), kKeyBits, stream).values;
}

}  // namespace packet::cuda
