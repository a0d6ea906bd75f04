#include "schedule/parallel.h"

#include <packet/error.h>

#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <string>

namespace packet {

int thread_count(int requested) {
    if (requested < 0) {
        throw Error(ErrorCode::kBadValue,
                    "threads is " + std::to_string(requested) + "; it must be 0 (all) or more");
    }
    // More than TBB will ever run would only make it complain on stderr.
    const auto most = static_cast<int>(
        tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
    return requested == 0 ? most : std::min(requested, most);
}

}  // namespace packet
