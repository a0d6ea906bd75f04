// Tables of things that have names on the command line: listing the names, and finding one.
#pragma once

#include <packet/error.h>

#include <algorithm>
#include <string>
#include <string_view>

namespace packet::tools {

/// A row of a table of names.
template <class Enum>
struct Named {
    Enum value;
    std::string_view name;
};

/// The names of a table whose rows have a member `name`: "a, b, c".
template <class Table>
[[nodiscard]] std::string list_names(const Table& table) {
    std::string list;
    for (const auto& row : table) list.append(list.empty() ? "" : ", ").append(row.name);
    return list;
}

/// The row of that name. Throws Error{kUnknownName} that says `what` it is and lists the valid
/// names.
template <class Table>
[[nodiscard]] const auto& find_name(std::string_view what, std::string_view name,
                                    const Table& table) {
    const auto row = std::find_if(std::begin(table), std::end(table),
                                  [&](const auto& candidate) { return candidate.name == name; });
    if (row == std::end(table)) {
        throw Error(ErrorCode::kUnknownName, "unknown " + std::string(what) + " '" +
                                                 std::string(name) +
                                                 "'; valid are: " + list_names(table));
    }
    return *row;
}

}  // namespace packet::tools
