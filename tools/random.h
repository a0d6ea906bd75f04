// Random numbers that are the same on every platform, for scenes and rays that must be too. The
// distributions of the standard library differ between implementations, and so do sines and
// logarithms; only the operations that IEEE 754 rounds exactly are used here.
//
// Steele, Lea, Flood. Fast splittable pseudorandom number generators. OOPSLA 2014.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cstdint>

namespace packet::tools {

/// A stream of random numbers. Streams of one seed are independent of each other, so that work can
/// be split by index among threads and come out the same.
class Random {
public:
    explicit Random(std::uint64_t seed, std::uint64_t stream = 0) noexcept
        : state_(mix(seed + kStep) ^ mix(mix(stream + kStep))) {}

    [[nodiscard]] std::uint64_t next() noexcept { return mix(state_ += kStep); }
    /// Uniform in [0, 1).
    [[nodiscard]] float uniform() noexcept {
        return static_cast<float>(next() >> 40) * 0x1p-24f;  // a float holds 24 bits
    }
    [[nodiscard]] float uniform(float low, float high) noexcept {
        return low + (high - low) * uniform();
    }
    /// Uniform in the cube [0, 1)^3. Braces, unlike parentheses, fix the order of the three calls.
    [[nodiscard]] glm::vec3 point() noexcept { return glm::vec3{uniform(), uniform(), uniform()}; }
    /// Of length 1, uniform over the sphere.
    [[nodiscard]] glm::vec3 direction() noexcept {
        for (;;) {
            const glm::vec3 p = 2.0f * point() - 1.0f;
            const float length2 = glm::dot(p, p);
            // Points near the centre have too few bits for an even direction.
            if (length2 <= 1.0f && length2 > 1e-4f) return p / glm::sqrt(length2);
        }
    }
    /// Of length 1, over the hemisphere about `normal` (of length 1), as likely as its cosine.
    [[nodiscard]] glm::vec3 cosine_direction(const glm::vec3& normal) noexcept {
        const glm::vec3 p = normal + direction();
        const float length2 = glm::dot(p, p);
        return length2 > 1e-12f ? p / glm::sqrt(length2) : normal;
    }

private:
    static constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15u;  // 2^64 / golden ratio, odd

    [[nodiscard]] static constexpr std::uint64_t mix(std::uint64_t z) noexcept {
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
        return z ^ (z >> 31);
    }

    std::uint64_t state_;
};

}  // namespace packet::tools
