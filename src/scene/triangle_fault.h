// Why a triangle can never be hit, if so. Builders leave such triangles out; the oracle of the
// tests asks the same question.
#pragma once

#include <packet/mesh.h>

#include <glm/vec3.hpp>

#include <cstdint>

namespace packet {

enum class TriangleFault : std::uint8_t { kNone, kNonFinite, kTooLarge, kZeroArea };

/// Exact: zero area means that the corners lie on one line as the numbers they are, not about so.
/// (Where exponents within a triangle differ by more than 2^29, differences of corners are
/// rounded.)
[[nodiscard]] TriangleFault find_fault(const glm::vec3& v0, const glm::vec3& v1,
                                       const glm::vec3& v2) noexcept;

/// Counts a fault under its reason; kNone counts nowhere.
void add_fault(SkippedTriangles& skipped, TriangleFault fault) noexcept;

}  // namespace packet
