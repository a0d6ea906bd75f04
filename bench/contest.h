// Times contenders on the same rays, once they are known to see the same.
#pragma once

#include "agreement.h"
#include "contender.h"
#include "ray_set.h"

#include <packet/mesh.h>

#include <cstddef>
#include <span>
#include <vector>

namespace packet::bench {

struct Score {
    const Contender* contender;
    /// With the first contender. Ours must answer alike bit for bit: all else is `different`.
    Agreement agreement;
    std::vector<double> seconds;  ///< of each run

    [[nodiscard]] double median_seconds() const;
};

struct Contest {
    int threads = 1;
    int repeats = 5;
};

/// Every contender's score on the rays, in the contenders' order; the first must be ours. After an
/// untimed run of each, whose answers are compared, runs alternate, so that a machine that slows
/// down or speeds up does so for all; each follows an untimed one of the same contender, which
/// fills the cache. `mesh` is what the scenes hold.
[[nodiscard]] std::vector<Score> hold(const Contest& contest, MeshView mesh, const RaySet& set,
                                      std::span<const Contender> contenders);

}  // namespace packet::bench
