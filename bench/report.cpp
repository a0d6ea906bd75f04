#include "report.h"

#include <packet/isa.h>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace packet::bench {
namespace {

// A speed means nothing next to one that was reached with other answers.
void print_differences(const Row& row) {
    for (const Score& score : row.scores) {
        if (score.agreement.acceptable()) continue;
        fmt::print("         {} {} sees {} of {} rays differently\n",
                   score.contender->side == Side::kOurs ? "our" : "Embree's", score.contender->name,
                   score.agreement.different, row.ray_count);
    }
}

nlohmann::json to_json(const Agreement& agreement) {
    return {{"same", agreement.same},
            {"tied", agreement.tied},
            {"borderline", agreement.borderline},
            {"different", agreement.different}};
}

nlohmann::json to_json(const Row& row) {
    nlohmann::json contenders = nlohmann::json::array();
    for (const Score& score : row.scores) {
        contenders.push_back({{"side", score.contender->side == Side::kOurs ? "packet" : "embree"},
                              {"mode", score.contender->name},
                              {"mrays_per_s", row.mrays_per_s(score)},
                              {"seconds", score.seconds},
                              {"agreement", to_json(score.agreement)}});
    }
    nlohmann::json out = {{"rays", row.rays},
                          {"query", to_string(row.query)},
                          {"ray_count", row.ray_count},
                          {"threads", row.contest.threads},
                          {"contenders", std::move(contenders)},
                          {"ratio", nullptr}};
    if (row.acceptable()) out["ratio"] = row.ratio();
    return out;
}

}  // namespace

bool Row::acceptable() const {
    return std::ranges::all_of(scores, [](const Score& s) { return s.agreement.acceptable(); });
}

const Score& Row::best(Side side) const {
    const auto key = [side](const Score& score) {
        return std::pair(score.contender->side != side, score.median_seconds());
    };
    return *std::ranges::min_element(scores, {}, key);
}

double Row::mrays_per_s(const Score& score) const {
    return 1e-6 * static_cast<double>(ray_count) / score.median_seconds();
}

const Score& Row::auto_score() const {
    return *std::ranges::find(scores, to_string(Mode::kAuto),
                              [](const Score& score) { return score.contender->name; });
}

double Row::ratio() const { return mrays_per_s(auto_score()) / mrays_per_s(best(Side::kEmbree)); }

void print_head(const Report& report, std::span<const Contender> contenders) {
    fmt::print("\n{}: {} triangles; built in", report.scene, report.triangle_count);
    for (const Build& build : report.builds)
        fmt::print("  {:.2f} s, {:.1f} MB ({})", build.seconds,
                   1e-6 * static_cast<double>(build.bytes), build.name);
    fmt::print("\nMrays/s; ours by {}, beside {}\n\nthreads  {:<8} {:<7}", to_string(default_isa()),
               embree_version(), "rays", "query");
    for (const Contender& contender : contenders) {
        if (contender.side == Side::kOurs) fmt::print("{:>10}", contender.name);
    }
    fmt::print("{:>10}  {:<11} auto : Embree\n", "Embree", "its mode");
    std::fflush(stdout);
}

void print_row(const Row& row) {
    fmt::print("{:>7}  {:<8} {:<7}", row.contest.threads, row.rays, to_string(row.query));
    for (const Score& score : row.scores) {
        if (score.contender->side == Side::kOurs) fmt::print("{:>10.2f}", row.mrays_per_s(score));
    }
    const Score& embree = row.best(Side::kEmbree);
    fmt::print("{:>10.2f}  {:<11} {}\n", row.mrays_per_s(embree), embree.contender->name,
               row.acceptable() ? fmt::format("{:.2f}", row.ratio()) : "none");
    print_differences(row);
    std::fflush(stdout);
}

nlohmann::json to_json(const Report& report) {
    nlohmann::json seconds, bytes, rows = nlohmann::json::array();
    for (const Build& build : report.builds) {
        seconds[std::string(build.name)] = build.seconds;
        bytes[std::string(build.name)] = build.bytes;
    }
    for (const Row& row : report.rows) rows.push_back(to_json(row));
    return {{"scene", report.scene},
            {"triangles", report.triangle_count},
            {"isa", to_string(default_isa())},
            {"embree", embree_version()},
            {"build_seconds", std::move(seconds)},
            {"build_bytes", std::move(bytes)},
            {"results", std::move(rows)}};
}

}  // namespace packet::bench
