// Morton codes: the bits of a point's three cell numbers in turn, so that points close in code are
// close in space.
//
// Morton. A computer oriented geodetic data base and a new technique in file sequencing. IBM 1966.
#pragma once

#include <packet/bounds.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace packet {

/// Moves bit i of the low 10 to bit 3i.
[[nodiscard]] constexpr std::uint32_t spread_10_bits(std::uint32_t x) noexcept {
    x &= 0x3FFu;
    x = (x | x << 16) & 0x030000FFu;
    x = (x | x << 8) & 0x0300F00Fu;
    x = (x | x << 4) & 0x030C30C3u;
    return (x | x << 2) & 0x09249249u;
}

/// Moves bit i of the low 21 to bit 3i.
[[nodiscard]] constexpr std::uint64_t spread_21_bits(std::uint64_t x) noexcept {
    x &= 0x1FFFFFu;
    x = (x | x << 32) & 0x001F00000000FFFFu;
    x = (x | x << 16) & 0x001F0000FF0000FFu;
    x = (x | x << 8) & 0x100F00F00F00F00Fu;
    x = (x | x << 4) & 0x10C30C30C30C30C3u;
    return (x | x << 2) & 0x1249249249249249u;
}

/// A code of 30 bits is a std::uint32_t, one of 63 bits a std::uint64_t. x has the highest bits.
template <class Code>
inline constexpr int kMortonBits = 0;
template <>
inline constexpr int kMortonBits<std::uint32_t> = 30;
template <>
inline constexpr int kMortonBits<std::uint64_t> = 63;

[[nodiscard]] constexpr std::uint32_t interleave(std::uint32_t x, std::uint32_t y,
                                                 std::uint32_t z) noexcept {
    return spread_10_bits(x) << 2 | spread_10_bits(y) << 1 | spread_10_bits(z);
}
[[nodiscard]] constexpr std::uint64_t interleave(std::uint64_t x, std::uint64_t y,
                                                 std::uint64_t z) noexcept {
    return spread_21_bits(x) << 2 | spread_21_bits(y) << 1 | spread_21_bits(z);
}

/// Cells of equal size over a box.
template <class Code>
class MortonGrid {
public:
    explicit MortonGrid(const Bounds3f& bounds) : origin_(bounds.lower) {
        const glm::vec3 extent = bounds.extent();
        const float scale =
            static_cast<float>(kCells) / std::max(std::max(extent.x, extent.y), extent.z);
        // No extent, or one so small that floats do not resolve it: one cell holds everything.
        scale_ = std::isfinite(scale) ? scale : 0.0f;
    }
    /// The code of a finite point in the box.
    [[nodiscard]] constexpr Code code(const glm::vec3& point) const noexcept {
        const glm::vec3 cell = (point - origin_) * scale_;
        return interleave(clamp(cell.x), clamp(cell.y), clamp(cell.z));
    }

private:
    static constexpr std::int32_t kCells = 1 << (kMortonBits<Code> / 3);

    static constexpr Code clamp(float cell) noexcept {
        return static_cast<Code>(std::min(static_cast<std::int32_t>(cell), kCells - 1));
    }

    glm::vec3 origin_;
    float scale_;
};

}  // namespace packet
