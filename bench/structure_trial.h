// All structures over one scene: what it takes to build each, and what it is worth.
#pragma once

#include "ray_set.h"

#include <packet/accel.h>
#include <packet/scene.h>
#include <packet/trace.h>

#include <camera.h>

#include <string>
#include <string_view>
#include <vector>

namespace packet::bench {

struct TrialScene {
    std::string name;
    TriangleMesh mesh;
    tools::CameraOptions camera;
};

/// What one thread makes of a set of rays.
struct RayFigures {
    double mrays_per_s;  ///< in mode `auto`
    TraceStats work;     ///< in mode `single`: `auto` may pick another mode in another run
};

struct StructureFigures {
    std::string_view name;
    double seconds_by_1, seconds_by_2;  ///< to build, by so many threads
    double bytes_per_triangle;
    double sah_cost;
    RayFigures primary, diffuse;
};

/// A scene with each of the structures.
class StructureTrial {
public:
    /// Builds all structures, `repeats` times each in turn.
    StructureTrial(const TrialScene& scene, int repeats);

    /// Traces. Throws std::runtime_error if two structures do not answer alike.
    [[nodiscard]] std::vector<StructureFigures> run() const;

    /// The nodes that single primary rays visit, by structure and pixel.
    [[nodiscard]] std::vector<std::vector<float>> nodes_per_pixel() const;

private:
    [[nodiscard]] std::vector<RayFigures> trace(tools::RayKind kind) const;

    tools::Camera camera_;
    int repeats_;
    std::vector<Scene> scenes_;  ///< one a structure, in the order of accel_names()
    std::vector<std::vector<double>> seconds_by_1_, seconds_by_2_;
};

}  // namespace packet::bench
