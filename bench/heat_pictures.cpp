#include "heat_pictures.h"

#include <packet/accel.h>

#include <fmt/core.h>

#include <image.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace packet::bench {
namespace {

// Of all pixels of all structures a thousandth is beyond the scale: a few pixels must not make all
// others dark.
float usual_most(std::span<const std::vector<float>> nodes) {
    std::vector<float> all;
    for (const std::vector<float>& some : nodes) all.insert(all.end(), some.begin(), some.end());
    const auto place = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 1000 * 999);
    std::nth_element(all.begin(), place, all.end());
    return std::max(*place, 1.0f);
}

}  // namespace

float write_heat_pictures(std::span<const std::vector<float>> nodes, tools::ImageSize size,
                          const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    const float most = usual_most(nodes);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        std::vector<glm::vec3> colors;
        for (const float count : nodes[i]) {
            // By the square root: where grids are at their worst, trees are near their usual.
            colors.push_back(tools::heat_color(std::sqrt(count / most)));
        }
        const std::string name = fmt::format("heat-{}.png", accel_names()[i].name);
        write_png(tools::OutputFile((folder / name).string()), to_image(size, colors));
    }
    return most;
}

}  // namespace packet::bench
