// What cutting a level of a k-d tree takes once its planes are chosen, for large cells and those
// within small ones: sides of references, cuts, sums of who goes where, moves.
#pragma once

#include "device_hierarchy.h"
#include "kd_level.h"
#include "ordered_bounds.h"
#include "prefix_sums.h"

namespace packet::cuda {

/// Which cells are cut, and what comes out: out of the large stage the small cells, out of the
/// small stage the leaves.
enum class KdStage : std::uint8_t { kLarge, kSmall };

/// A hierarchy's nodes as they come about.
struct KdNodes {
    DeviceArray<BuildNode> nodes;
    std::uint32_t count = 0;
};

/// Where a child's references go.
struct KdDestination {
    std::uint32_t first;  ///< reference
    std::uint32_t cell;
    bool goes_out;  ///< of the stage; else to the next level
};

/// Cuts levels of one stage. Keeps its memory from level to level.
class KdStep {
public:
    KdStep(DeviceMesh mesh, KdStage stage, KdLimits limits, const Stream& stream)
        : mesh_(mesh), stage_(stage), limits_(limits), stream_(stream) {}

    /// Room for the planes and fates of the level, to be filled before advance().
    void make_room(const KdDeviceLevel& level);
    [[nodiscard]] KdPlane* planes() const { return planes_.data(); }
    [[nodiscard]] KdFate* fates() const { return fates_.data(); }

    /// Replaces the level by the next, appends to `out` what leaves, and to `nodes` the children.
    void advance(KdDeviceLevel& level, KdDeviceLevel& out, KdNodes& nodes);

    /// What kernels see of it: arrays by reference of the level, by cell, and by child, which is
    /// 2 * cell + side.
    struct View {
        KdPlane* planes;              ///< by cell
        KdFate* fates;                ///< by cell
        std::uint8_t* sides;          ///< by reference: where it goes
        std::uint64_t* side_sums;     ///< of the references before: how many go to either side
        std::uint32_t* cut_sums;      ///< of the references before: how many are cut
        Bounds3f* parts;              ///< [2 * cut reference + side]
        KdRange* children;            ///< by child, if it has references
        OrderedBounds* bounds;        ///< by child
        KdSet* sets;                  ///< by child
        KdDestination* destinations;  ///< by child
    };

private:
    void choose_sides(const KdDeviceLevel& level);
    /// Counts in `counter_` the cells whose fates it has changed.
    void check_depth(const KdDeviceLevel& level);
    void part_without_cutting(const KdDeviceLevel& level);
    void sum_sides(const KdDeviceLevel& level);
    void cut(const KdDeviceLevel& level);
    void move(KdDeviceLevel& level, KdDeviceLevel& out, KdNodes& nodes);
    [[nodiscard]] View view() const;

    DeviceMesh mesh_;
    KdStage stage_;
    KdLimits limits_;
    const Stream& stream_;
    PrefixSums prefix_sums_;
    KdDeviceLevel next_;
    // By reference of the level:
    DeviceArray<std::uint8_t> sides_;
    DeviceArray<std::uint64_t> side_counts_, side_sums_;
    DeviceArray<std::uint32_t> is_cut_, cut_sums_, cut_references_;
    DeviceArray<Bounds3f> parts_;
    // By cell:
    DeviceArray<KdPlane> planes_;
    DeviceArray<KdFate> fates_;
    DeviceArray<std::uint32_t> is_parent_, parent_sums_;
    // By child:
    DeviceArray<KdRange> children_;
    DeviceArray<OrderedBounds> bounds_;
    DeviceArray<KdSet> sets_;
    DeviceArray<KdDestination> destinations_;
    DeviceArray<std::uint64_t> reference_counts_, reference_sums_, cell_counts_, cell_sums_;
    DeviceArray<std::uint32_t> counter_{1};
};

}  // namespace packet::cuda
