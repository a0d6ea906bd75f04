// A reader of JSON events that follows a table of the properties a scene of triangles is made of.
#include "scene/gltf_filter.h"

#include "scene/gltf_rules.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

namespace packet::gltf {
namespace {

// tinygltf takes 300 to 500 bytes for an object, of which a file may hold one every 3 bytes, and
// twice that while an array grows.
constexpr std::size_t kModelObjectSize = 1024;

/// What a value must be, for errors. In the order of Kind.
const char* describe(Kind kind) {
    constexpr std::array<const char*, 7> kWords = {"an object",
                                                   "an array",
                                                   "a string",
                                                   "true or false",
                                                   "a number",
                                                   "an integer from 0 to 2147483647",
                                                   "a non-negative integer"};
    return kWords[static_cast<std::size_t>(kind)];
}

/// Receives the events of a JSON parser. Functions are named by nlohmann::json_sax.
class Filter final : public nlohmann::json_sax<nlohmann::json> {
public:
    Filter(std::size_t json_size, const FileErrors& errors)
        : errors_(errors), budget_(json_size, errors) {}
    FilteredJson take() { return std::move(result_); }

    bool null() override { return scalar({}, ""); }
    bool boolean(bool value) override { return scalar({Kind::kBool}, value ? "true" : "false"); }
    bool number_integer(number_integer_t value) override {
        return scalar({Kind::kNumber}, std::to_string(value));
    }
    bool number_float(number_float_t value, const string_t&) override;
    bool number_unsigned(number_unsigned_t value) override;
    bool string(string_t& value) override;
    bool binary(binary_t&) override { return true; }  // JSON has none

    bool start_object(std::size_t) override { return start(Kind::kObject); }
    bool start_array(std::size_t) override { return start(Kind::kArray); }
    bool end_array() override { return end(); }
    bool end_object() override;
    bool key(string_t& name) override;
    bool parse_error(std::size_t at, const std::string&,
                     const nlohmann::detail::exception&) override {
        // The exception's own text would quote the file, which may be megabytes of anything.
        errors_.fail("is not valid JSON at byte ", at);
    }

private:
    /// An object or array that is being read.
    struct Level {
        std::size_t rule;
        std::size_t next_index = 0;  ///< of an array's next element
        std::size_t written = 0;
        std::uint64_t seen = 0;  ///< an object's rules that were met
    };

    bool start(Kind kind);
    bool end();
    bool scalar(std::initializer_list<Kind> kinds, std::string_view json);
    /// Finds the rule of the value that begins; kRuleCount if there is none.
    std::size_t enter();
    /// The same for a scalar, which must be of one of the kinds.
    std::size_t enter_scalar(std::initializer_list<Kind> kinds);
    /// Writes what stands before a value: a comma, and its name if it is in an object.
    void write_name(std::size_t rule);
    [[noreturn]] void fail_type(std::size_t rule) const;
    [[nodiscard]] std::string place(std::size_t rule) const;

    const FileErrors& errors_;
    MemoryBudget budget_;
    FilteredJson result_;
    std::vector<Level> levels_;
    std::size_t key_rule_ = 0;       ///< of the value that comes next; at first the root's
    std::size_t dropped_depth_ = 0;  ///< containers that are open and have no rule
};

/// "meshes[3].primitives[0].indices" for the value of a rule that begins, or misses, where we are.
std::string Filter::place(std::size_t rule) const {
    std::string text;
    for (std::size_t i = 1; i <= levels_.size(); ++i) {
        const std::string_view name = kTree[i < levels_.size() ? levels_[i].rule : rule].name;
        if (name == "[]") {
            text += '[' + std::to_string(levels_[i - 1].next_index - 1) + ']';
        } else {
            text += (text.empty() ? "" : ".") + std::string(name);
        }
    }
    return text.empty() ? "the JSON" : text;
}

void Filter::fail_type(std::size_t rule) const {
    errors_.fail(place(rule), ": must be ", describe(kRules[rule].kind));
}

bool Filter::key(string_t& name) {
    if (dropped_depth_ != 0) return true;
    Level& object = levels_.back();
    key_rule_ = find_child(object.rule, name);
    if (key_rule_ == kRuleCount) return true;
    const std::uint64_t bit = std::uint64_t{1} << key_rule_;
    if ((object.seen & bit) != 0) errors_.fail(place(key_rule_), ": occurs twice");
    object.seen |= bit;
    return true;
}

std::size_t Filter::enter() {
    if (dropped_depth_ != 0) return kRuleCount;
    if (levels_.empty() || kRules[levels_.back().rule].kind == Kind::kObject) return key_rule_;
    ++levels_.back().next_index;
    return find_child(levels_.back().rule, "[]");
}

void Filter::write_name(std::size_t rule) {
    if (levels_.empty()) return;
    if (levels_.back().written++ != 0) result_.json += ',';
    if (kTree[rule].name == "[]") return;
    ((result_.json += '"') += kTree[rule].name) += "\":";
}

bool Filter::start(Kind kind) {
    const std::size_t rule = enter();
    if (rule == kRuleCount) {
        ++dropped_depth_;
        return true;
    }
    if (kRules[rule].kind != kind) fail_type(rule);
    if (kRules[rule].use == Use::kModel) {
        if (kind == Kind::kObject && !budget_.take(1, kModelObjectSize)) {
            errors_.fail_as(ErrorCode::kTooLarge, place(rule),
                            ": is one object more than a file of this size may hold");
        }
        write_name(rule);
        result_.json += kind == Kind::kObject ? '{' : '[';
    } else if (kind == Kind::kObject) {
        result_.buffers.emplace_back();
    }
    levels_.push_back({rule});
    return true;
}

bool Filter::end() {
    if (dropped_depth_ != 0) {
        --dropped_depth_;
        return true;
    }
    const Level level = levels_.back();
    levels_.pop_back();
    const Rule& rule = kRules[level.rule];
    if (rule.size != 0 && level.next_index != rule.size) {
        errors_.fail(place(level.rule), ": must have ", rule.size, " elements");
    }
    if (rule.use == Use::kModel) result_.json += rule.kind == Kind::kObject ? '}' : ']';
    if (rule.path == "bufferViews") result_.buffer_view_count = level.next_index;
    if (rule.path == "accessors") result_.accessor_count = level.next_index;
    if (rule.path == "meshes") result_.mesh_count = level.next_index;
    return true;
}

bool Filter::end_object() {
    if (dropped_depth_ == 0) {
        const Level& level = levels_.back();
        const std::uint64_t missing = kTree[level.rule].required & ~level.seen;
        if (missing != 0) {
            const auto rule = static_cast<std::size_t>(std::countr_zero(missing));
            errors_.fail(place(rule), ": is missing");
        }
    }
    return end();
}

std::size_t Filter::enter_scalar(std::initializer_list<Kind> kinds) {
    const std::size_t rule = enter();
    if (rule == kRuleCount) return rule;
    if (std::find(kinds.begin(), kinds.end(), kRules[rule].kind) == kinds.end()) fail_type(rule);
    return rule;
}

bool Filter::scalar(std::initializer_list<Kind> kinds, std::string_view json) {
    const std::size_t rule = enter_scalar(kinds);
    if (rule == kRuleCount) return true;
    write_name(rule);
    result_.json += json;
    return true;
}

bool Filter::number_float(number_float_t value, const string_t&) {
    // Not as it stands in the file: the parser hands on the point as the locale has it.
    char text[32];
    const char* end = std::to_chars(std::begin(text), std::end(text), value).ptr;
    return scalar({Kind::kNumber}, {text, end});
}

bool Filter::number_unsigned(number_unsigned_t value) {
    const bool is_index = value <= std::numeric_limits<std::int32_t>::max();
    const std::size_t rule =
        enter_scalar({Kind::kNumber, Kind::kSize, is_index ? Kind::kIndex : Kind::kSize});
    if (rule == kRuleCount) return true;
    if (kRules[rule].use == Use::kField) {
        result_.buffers.back().byte_length = value;
        return true;
    }
    write_name(rule);
    result_.json += std::to_string(value);
    return true;
}

bool Filter::string(string_t& value) {
    const std::size_t rule = enter_scalar({Kind::kString});
    if (rule == kRuleCount) return true;
    if (kRules[rule].use == Use::kModel) {
        write_name(rule);
        result_.json += nlohmann::json(value).dump();
    } else if (kTree[rule].name == "uri") {
        result_.buffers.back().uri = std::move(value);
    } else {
        result_.required_extensions.push_back(std::move(value));
    }
    return true;
}

}  // namespace

FilteredJson filter_json(std::string_view text, const FileErrors& errors) {
    Filter filter(text.size(), errors);
    nlohmann::json::sax_parse(text.begin(), text.end(), &filter);
    return filter.take();
}

}  // namespace packet::gltf
