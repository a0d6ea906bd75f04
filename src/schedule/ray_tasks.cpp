#include "schedule/ray_tasks.h"

#include <algorithm>
#include <utility>

namespace packet {

std::size_t rays_per_stream_task(std::size_t rays, int threads) noexcept {
    constexpr std::size_t kMost = StreamOrder::kMostRays;
    constexpr std::size_t kTasksPerThread = 8;
    if (threads == 1) return kMost;
    return std::clamp(rays / (kTasksPerThread * static_cast<std::size_t>(threads)),
                      kLeastRaysForStreams, kMost);
}

RayTasks RayTasks::sorted(std::span<const Ray> rays, int threads,
                          KernelTable::StreamKeys find_keys) {
    RayTasks out(rays, PixelLayout());
    out.find_keys_ = find_keys;
    out.run_length_ = rays_per_stream_task(rays.size(), threads);
    out.orders_ = std::make_unique<StreamOrders>();
    return out;
}

void RayTasks::sort_together(const Parallel& parallel) {
    order_.resize(rays_.size());
    for (std::size_t first = 0; first < rays_.size(); first += kMostSortedTogether) {
        const std::size_t count = std::min(kMostSortedTogether, rays_.size() - first);
        sort_many(rays_.subspan(first, count), find_keys_, std::span(order_).subspan(first, count),
                  static_cast<std::uint32_t>(first), parallel);
    }
}

std::size_t RayTasks::count() const {
    return image_.is_image() ? image_.tile_count() : (rays_.size() + run_length_ - 1) / run_length_;
}

void RayTasks::run(std::size_t task, TraceBatch batch,
                   const std::function<void(const TraceBatch&)>& trace) const {
    PixelOrder::Indices pixels;
    std::unique_ptr<StreamOrder> sorted;
    std::size_t first = task * run_length_;
    batch.count = std::min(run_length_, rays_.size() - std::min(first, rays_.size()));
    if (!order_.empty()) {
        batch.order = order_.data() + first;
        first = 0;
    } else if (image_.is_image()) {
        first = image_.first_ray(task);
        const PixelTile tile = image_.fill(task, pixels);
        batch.order = pixels.data();
        batch.count = tile.count;
        batch.row_bits = tile.row_bits;
    } else if (orders_ != nullptr) {
        sorted = orders_->take();
        batch.order = sorted->sort(rays_.subspan(first, batch.count), find_keys_).data();
    }
    batch.rays = rays_.data() + first;
    if (batch.hits != nullptr) batch.hits += first;
    if (batch.occluded != nullptr) batch.occluded += first;
    if (batch.stats != nullptr) batch.stats->rays += batch.count;
    trace(batch);
    if (sorted != nullptr) orders_->give_back(std::move(sorted));
}

}  // namespace packet
