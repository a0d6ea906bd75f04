// A city: lots in blocks between streets, on each a building with a roof and windows, all of boxes.
// Higher buildings get more of the boxes, as windows.
#include "generate.h"
#include "random.h"

#include <glm/common.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace packet::tools {
namespace {

constexpr std::size_t kTrianglesPerBox = 12;
constexpr double kBoxesPerLot = 160.0;    // on average, or more: windows look like windows
constexpr std::size_t kLotsPerBlock = 4;  // a side

// In metres.
constexpr float kLot = 30.0f;
constexpr float kStreet = 16.0f;
constexpr float kCurb = 0.15f;
constexpr float kFloor = 3.5f;

void add_box(const glm::vec3& lower, const glm::vec3& upper, TriangleMesh& mesh) {
    static constexpr std::uint32_t kFaces[kTrianglesPerBox][3] = {
        {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
        {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int corner = 0; corner < 8; ++corner) {
        mesh.positions.emplace_back((corner & 1 ? upper : lower).x, (corner & 2 ? upper : lower).y,
                                    (corner & 4 ? upper : lower).z);
    }
    for (const auto& face : kFaces) {
        mesh.triangles.emplace_back(first + face[0], first + face[1], first + face[2]);
    }
}

/// Where lot number `i` of a row begins.
float lot_start(std::size_t i) {
    const std::size_t streets = i / kLotsPerBlock;
    return static_cast<float>(i) * kLot + static_cast<float>(streets) * kStreet;
}

/// Many low buildings and few towers, which stand towards the centre. `place` is in [-1, 1]^2.
float building_height(glm::vec2 place, Random& random) {
    const float centrality = 1.0f - 0.5f * (place.x * place.x + place.y * place.y);
    const float low = random.uniform(2.0f, 8.0f);
    const float rarity = random.uniform();
    const float tower = 60.0f * centrality * centrality * rarity * rarity * rarity * rarity;
    return kFloor * std::floor(low + tower);
}

struct Building {
    glm::vec2 lot;  ///< the lot's lower corner
    float height;
    Random random;
};

/// The buildings of a city of `side` by `side` lots, row by row.
std::vector<Building> plan(std::size_t side, std::uint64_t seed) {
    std::vector<Building> buildings;
    buildings.reserve(side * side);
    for (std::size_t i = 0; i < side * side; ++i) {
        const glm::vec2 lot(lot_start(i % side), lot_start(i / side));
        Random random(seed, i);
        const float height = building_height(2.0f * lot / lot_start(side) - 1.0f, random);
        buildings.push_back({lot, height, random});
    }
    return buildings;
}

/// Window number `i` of a building's body, floor by floor around its four faces.
void add_window(const glm::vec3& lower, const glm::vec3& upper, std::size_t i, std::size_t columns,
                TriangleMesh& mesh) {
    const std::size_t face = i / columns % 4, floor = i / (4 * columns);
    const int along = face < 2 ? 0 : 2, across = 2 - along;
    const float width = (upper[along] - lower[along]) / static_cast<float>(columns);
    const float start = lower[along] + static_cast<float>(i % columns) * width;
    const float sill = lower.y + static_cast<float>(floor) * kFloor + 0.9f;
    const float wall = face % 2 == 0 ? lower[across] : upper[across];
    glm::vec3 from(0.0f, sill, 0.0f), to(0.0f, sill + 1.7f, 0.0f);
    from[along] = start + 0.2f * width, to[along] = start + 0.8f * width;
    from[across] = wall - 0.1f, to[across] = wall + 0.1f;
    add_box(from, to, mesh);
}

/// A building of exactly `boxes` boxes: pavement, body, podium, roof and the rest as windows.
void add_building(Building building, std::size_t boxes, TriangleMesh& mesh) {
    Random& random = building.random;
    const glm::vec2 corner = building.lot;
    const auto add = [&](glm::vec2 from, glm::vec2 to, float bottom, float top) {
        if (boxes == 0) return;
        --boxes;
        add_box({corner.x + from.x, bottom, corner.y + from.y},
                {corner.x + to.x, top, corner.y + to.y}, mesh);
    };
    const glm::vec2 from{random.uniform(3.0f, 9.0f), random.uniform(3.0f, 9.0f)};
    const glm::vec2 to{random.uniform(21.0f, 27.0f), random.uniform(21.0f, 27.0f)};
    const float roof = kCurb + building.height;
    add(glm::vec2(0.0f), glm::vec2(kLot), 0.0f, kCurb);
    add(from, to, kCurb, roof);
    add(from - 2.0f, to + 2.0f, kCurb, kCurb + kFloor);
    for (int i = 0; i < 4; ++i) {  // lift housing, tanks and the like
        const glm::vec2 place{random.uniform(from.x, to.x - 3.0f),
                              random.uniform(from.y, to.y - 3.0f)};
        const float size = random.uniform(1.0f, 3.0f), height = random.uniform(0.5f, 3.0f);
        add(place, place + size, roof, roof + height);
    }
    const auto floors = static_cast<std::size_t>(building.height / kFloor);
    const std::size_t columns = (boxes + 4 * floors - 1) / (4 * floors);
    const glm::vec3 lower(corner.x + from.x, kCurb, corner.y + from.y);
    const glm::vec3 upper(corner.x + to.x, roof, corner.y + to.y);
    for (std::size_t i = 0; i < boxes; ++i) add_window(lower, upper, i, columns, mesh);
}

void add_ground(float side, TriangleMesh& mesh) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {{-kStreet, 0.0f, -kStreet},
                                                 {side, 0.0f, -kStreet},
                                                 {-kStreet, 0.0f, side},
                                                 {side, 0.0f, side}});
    mesh.triangles.emplace_back(first, first + 2, first + 1);
    mesh.triangles.emplace_back(first + 1, first + 2, first + 3);
}

}  // namespace

TriangleMesh make_city(std::size_t triangle_count, std::uint64_t seed) {
    const std::size_t boxes = (std::max<std::size_t>(triangle_count, 2) - 2) / kTrianglesPerBox;
    const double lots = static_cast<double>(boxes) / kBoxesPerLot;
    const auto side = static_cast<std::size_t>(std::max(std::sqrt(lots), 1.0));
    const std::vector<Building> buildings = plan(side, seed);
    double total_height = 0.0;
    for (const Building& building : buildings) total_height += building.height;

    TriangleMesh mesh;
    mesh.name = "city";
    mesh.positions.reserve(8 * boxes + 4);
    mesh.triangles.reserve(kTrianglesPerBox * boxes + 2);
    double height = 0.0;  // of the buildings so far: each gets its share of the boxes
    std::size_t used = 0;
    for (const Building& building : buildings) {
        height += building.height;
        const double share = height / total_height;
        const auto until = static_cast<std::size_t>(share * static_cast<double>(boxes));
        add_building(building, until - used, mesh);
        used = until;
    }
    add_ground(lot_start(side) + kStreet, mesh);
    return mesh;
}

}  // namespace packet::tools
