#include "kd_build.h"

#include "build/kd_cell.h"
#include "build/kd_large_stage.h"
#include "build/kd_levels.h"
#include "kd_numbering.h"
#include "kd_planes.h"
#include "kd_step.h"

#include <packet/error.h>

#include <algorithm>
#include <string>

namespace packet::cuda {

namespace {

// Small cells that are cut up at a time: enough threads to fill a device, few enough that their
// masks (240 bytes a reference) take tens of megabytes.
constexpr std::uint32_t kBatchCells = 8192;

// Threads, and words of bins, are counted by 32 bits.
constexpr std::size_t kMaxDeviceReferences = std::size_t{1} << 29;

/// The references as make_kd_root() has them, and their bounds.
__global__ void start_root(Reference* references, std::uint32_t count, std::uint32_t* cell_of,
                           OrderedBounds* bounds) {
    const unsigned thread = thread_in_grid();
    const unsigned i = thread < count ? thread : count - 1;
    const Bounds3f box = without_negative_zero(references[i].bounds());
    extend_by_warp(*bounds, OrderedBounds::from(box));
    if (thread >= count) return;
    references[i].lower = box.lower;
    references[i].upper = box.upper;
    references[i].unused = 0;
    cell_of[i] = 0;
}

/// Makes small cells, from `first_cell` on, a level of their own.
__global__ void start_batch(KdLevelView small, std::uint32_t first_cell, std::uint32_t first,
                            std::uint32_t count, Reference* references, std::uint32_t* cell_of) {
    const unsigned i = thread_in_grid();
    if (i >= count) return;
    const std::uint32_t cell = small.cell_of[first + i];
    references[i] = small.references[first + i];
    references[i].unused = first + i - static_cast<std::uint32_t>(small.cells[cell].first);
    cell_of[i] = cell - first_cell;
}
__global__ void start_batch_cells(const KdSetCell* small, std::uint32_t count, std::uint32_t first,
                                  KdSetCell* cells) {
    const unsigned i = thread_in_grid();
    if (i >= count) return;
    KdSetCell cell = small[i];
    cell.first -= first;
    cell.node = cell.root = i;
    cell.set = ~KdSet{0} >> (kMaxSetSize - cell.count);
    cells[i] = cell;
}

class Builder {
public:
    Builder(const UploadedMesh& mesh, const BuildOptions& options, std::uint32_t count)
        : mesh_(mesh.view()),
          limits_{options, max_cut_depth(count), static_cast<std::uint32_t>(options.max_leaf_size)},
          spare_(spare_of_root(count, options, kMaxReferences)),
          small_step_(mesh_, KdStage::kSmall, limits_, stream_) {
        if (count + spare_ > kMaxDeviceReferences) {
            throw Error(ErrorCode::kTooLarge,
                        "a k-d tree of up to " + std::to_string(count + spare_) +
                            " references is too large to be built on a CUDA device, which takes " +
                            std::to_string(kMaxDeviceReferences) +
                            ": lower BuildOptions::max_reference_factor");
        }
    }

    DeviceHierarchy build(DeviceArray<Reference> references, std::uint32_t count) {
        KdDeviceLevel root = make_root(std::move(references), count);
        KdDeviceLevel small = run_large_stage(std::move(root));
        for (std::uint32_t first = 0; first < small.cell_count; first += kBatchCells) {
            run_batch(small, first, std::min(kBatchCells, small.cell_count - first));
        }
        return std::move(out_);
    }

private:
    KdDeviceLevel make_root(DeviceArray<Reference> references, std::uint32_t count) {
        const OrderedBounds nothing = OrderedBounds::empty();
        DeviceArray<OrderedBounds> bounds(std::span<const OrderedBounds>(&nothing, 1));
        KdDeviceLevel root;
        root.references = std::move(references);
        root.cell_of.make_room(count);
        for_each_item(count, stream_, start_root, root.references.data(), count,
                      root.cell_of.data(), bounds.data());
        KdSetCell cell;
        cell.bounds = bounds.value(0, stream_).bounds();
        cell.count = count;
        cell.spare = spare_;
        root.cells = DeviceArray<KdSetCell>(std::span<const KdSetCell>(&cell, 1));
        root.reference_count = count;
        root.cell_count = 1;
        return root;
    }

    /// Yields the small cells.
    KdDeviceLevel run_large_stage(KdDeviceLevel level) {
        KdNodes nodes;
        nodes.nodes.make_room(1);
        nodes.count = 1;
        KdDeviceLevel small;
        if (level.reference_count <= kMaxSmallCell) std::swap(level, small);
        KdStep step(mesh_, KdStage::kLarge, limits_, stream_);
        KdBinPlanes planes;
        while (level.cell_count != 0) {
            step.make_room(level);
            planes.find(level, limits_, step.planes(), step.fates(), stream_);
            step.advance(level, small, nodes);
        }
        stream_.synchronize();
        out_.nodes = std::move(nodes.nodes);
        out_.node_count = nodes.count;
        return small;
    }

    void run_batch(const KdDeviceLevel& small, std::uint32_t first, std::uint32_t count) {
        start(small, first, count);
        masks_.prepare(level_, stream_);
        KdBatchNodes batch;
        batch.nodes.nodes.make_room(count);
        batch.nodes.count = count;
        batch.level_ends.push_back(count);
        leaves_.reference_count = leaves_.cell_count = 0;
        while (level_.cell_count != 0) {
            small_step_.make_room(level_);
            masks_.find(level_, limits_, small_step_.planes(), small_step_.fates(), stream_);
            small_step_.advance(level_, leaves_, batch.nodes);
            batch.level_ends.push_back(batch.nodes.count);
        }
        append_batch(batch, leaves_, small.cells.data() + first, count, out_, stream_);
    }
    void start(const KdDeviceLevel& small, std::uint32_t first, std::uint32_t count) {
        const KdSetCell begin = small.cells.value(first, stream_);
        const KdSetCell last = small.cells.value(first + count - 1, stream_);
        const auto first_reference = static_cast<std::uint32_t>(begin.first);
        const auto references = static_cast<std::uint32_t>(last.first + last.count - begin.first);
        level_.reference_count = level_.cell_count = 0;
        level_.grow(references, count, stream_);
        level_.reference_count = references;
        level_.cell_count = count;
        for_each_item(references, stream_, start_batch, small.view(), first, first_reference,
                      references, level_.references.data(), level_.cell_of.data());
        for_each_item(count, stream_, start_batch_cells, small.cells.data() + first, count,
                      first_reference, level_.cells.data());
    }

    Stream stream_;
    DeviceMesh mesh_;
    KdLimits limits_;
    std::size_t spare_;
    DeviceHierarchy out_;
    // Of a batch; they keep their memory.
    KdStep small_step_;
    KdMaskPlanes masks_;
    KdDeviceLevel level_, leaves_;
};

}  // namespace

DeviceHierarchy build_kd_levels(const UploadedMesh& mesh, DeviceArray<Reference> references,
                                std::uint32_t reference_count, const BuildOptions& options) {
    if (reference_count == 0) return {};
    return Builder(mesh, options, reference_count).build(std::move(references), reference_count);
}

}  // namespace packet::cuda
