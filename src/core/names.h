// Tables of names: every choice that can be named outside has one, and unknown names list it.
#pragma once

#include <packet/error.h>

#include <string>
#include <string_view>

namespace packet {

/// The entry of `table` with that name. Throws Error{kUnknownName} that lists the valid names.
template <class Table>
[[nodiscard]] auto find_by_name(const Table& table, std::string_view name, const char* what) {
    std::string valid;
    for (const auto& entry : table) {
        if (entry.name == name) return entry;
        valid += (valid.empty() ? "" : ", ") + std::string(entry.name);
    }
    throw Error(ErrorCode::kUnknownName, "unknown " + std::string(what) + " '" + std::string(name) +
                                             "'; valid are: " + valid);
}

}  // namespace packet
