#include "schedule/pixel_layout.h"

#include "schedule/auto_mode.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace packet {

namespace {

// Fewer are not worth looking at.
constexpr std::size_t kLeastRays = 1024;
// What is looked at to find a line's end must not count beside tracing.
constexpr std::size_t kLeastLines = 32;
constexpr std::size_t kMostWidth = 16384;
// The sides of blocks that tiles of the same or another size are made of.
constexpr std::size_t kLeastSide = 4, kMostSide = 32;
// Narrower ones do not hold a row of what a packet holds.
constexpr std::size_t kLeastWidth = 8;
// A jump is so many times as long as the steps before it, jittered or not: from a block of 4 x 4's
// line to its next it is 3.2, and of jittered pixels no step is longer than 2 of the mean.
constexpr float kJump = 2.5f;

/// Points that rays pass, about where they hit something.
class Points {
public:
    Points(std::span<const Ray> rays, const Bounds3f& world)
        : rays_(rays), t_(distance_to_hit(rays[0].org, world)) {}

    [[nodiscard]] glm::vec3 of(std::size_t ray) const {
        return rays_[ray].org + t_ * glm::normalize(rays_[ray].dir);
    }
    [[nodiscard]] float distance(std::size_t a, std::size_t b) const {
        return glm::distance(of(a), of(b));
    }
    /// Of rays 0, stride, 2 stride ... `count` of them: how many come before the first that is far
    /// from the one before it.
    [[nodiscard]] std::size_t before_jump(std::size_t stride, std::size_t count) const {
        float sum = 0.0f;
        glm::vec3 last = of(0);
        for (std::size_t i = 1; i < count; ++i) {
            const glm::vec3 point = of(i * stride);
            const float step = glm::distance(point, last);
            const bool is_near = step * static_cast<float>(i - 1) <= kJump * sum;
            if (i > 1 && !is_near) return i;
            sum += step;
            last = point;
        }
        return count;
    }
    /// As before_jump(), but before the first that goes back on the step before it, be it as short.
    /// Jittered neighbours may, blocks do not.
    [[nodiscard]] std::size_t before_turn(std::size_t stride, std::size_t count) const {
        glm::vec3 last = of(0), last_step(0.0f);
        for (std::size_t i = 1; i < count; ++i) {
            const glm::vec3 point = of(i * stride), step = point - last;
            if (glm::dot(step, last_step) < 0.0f) return i;
            last = point;
            last_step = step;
        }
        return count;
    }

private:
    std::span<const Ray> rays_;
    float t_;
};

bool is_side(std::size_t pixels) {
    return pixels >= kLeastSide && pixels <= kMostSide && (pixels & (pixels - 1)) == 0;
}

/// The layout that the first rays' jumps speak for.
PixelLayout guess_layout(const Points& points, std::size_t count) {
    const std::size_t most = std::min(count / kLeastLines, kMostWidth);
    const std::size_t width = points.before_jump(1, most + 1);
    if (width > most) return {};
    const std::size_t height = points.before_jump(width, std::min(count / width, kMostSide + 1));
    if (is_side(width) && is_side(height)) {
        const std::size_t block = width * height;
        const std::size_t most_blocks = std::min(most / width, count / block - 1);
        const std::size_t line = width * points.before_turn(block, most_blocks + 1);
        const bool has_turn = line <= width * most_blocks;
        if (has_turn && count % (line * height) == 0) return {line, width, height};
    }
    return width >= kLeastWidth ? PixelLayout::scanlines(width) : PixelLayout{};
}

/// Of 0, 1 ... `count` - 1 the one that the part behind the point of `turns` leads to.
std::size_t part_of(std::size_t count, double turns) {
    const double part = turns - std::floor(turns);
    return std::min(static_cast<std::size_t>(part * static_cast<double>(count)), count - 1);
}

/// Whether most pixels of a sample are about as near to that on their right as to that below, and
/// nearer to both than to another of the sample. (Not all: blocks that are taken for parts of
/// scanlines end somewhere.)
bool is_confirmed(const PixelLayout& layout, const Points& points, std::size_t count) {
    constexpr std::size_t kMostSamples = 64, kRaysPerSample = 64;
    constexpr float kMostStretch = 4.0f, kLeastSpread = 4.0f;
    const std::size_t height = count / layout.width;
    if (layout.width < 2 || height < 2) return false;
    const std::size_t samples = std::min(count / kRaysPerSample, kMostSamples);
    std::size_t confirmed = 0, last = 0;
    for (std::size_t i = 1; i <= samples; ++i) {
        // as evenly spread as a sequence can be, and in step with no block
        const std::size_t x = part_of(layout.width - 1, 0.7548776662 * static_cast<double>(i));
        const std::size_t y = part_of(height - 1, 0.5698402910 * static_cast<double>(i));
        const std::size_t ray = layout.column(x) + layout.row(y);
        const float right = points.distance(ray, layout.column(x + 1) + layout.row(y));
        const float down = points.distance(ray, layout.column(x) + layout.row(y + 1));
        const bool is_square = right <= kMostStretch * down && down <= kMostStretch * right;
        // false for NaN
        if (is_square && kLeastSpread * (right + down) <= points.distance(ray, last)) ++confirmed;
        last = ray;
    }
    return 8 * confirmed >= 7 * samples;
}

}  // namespace

PixelLayout find_layout(std::span<const Ray> rays, const Bounds3f& world) {
    if (rays.size() < kLeastRays) return {};
    const Points points(rays, world);
    const PixelLayout layout = guess_layout(points, rays.size());
    return layout.is_image() && is_confirmed(layout, points, rays.size()) ? layout : PixelLayout{};
}

}  // namespace packet
