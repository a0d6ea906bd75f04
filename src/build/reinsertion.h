// Mends what greedy splits near the root spoilt: a subtree whose box widens its ancestors' moves to
// where it widens others least. Few subtrees are worth it, the largest, so it takes little time.
//
// Bittner, Hapala, Havran. Fast insertion-based optimization of bounding volume hierarchies. CGF
// 2013. Meister, Bittner. Parallel reinsertion for bounding volume hierarchy optimization. CGF
// 2018.
#pragma once

#include "build/hierarchy.h"

namespace packet {

/// Makes the sum of inner nodes' areas less. No leaf gets deeper than kMaxDepth. The hierarchy's
/// wide children must not be given. O(n) for looking at it, O(log n) for most subtrees that may
/// move; parallel; the result does not depend on the number of threads.
void reinsert_subtrees(Hierarchy& hierarchy, const Parallel& parallel);

}  // namespace packet
