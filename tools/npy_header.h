// The header of a NumPy array file: a Python dictionary as text.
//
// numpy.lib.format, "The npy file format", versions 1.0 to 3.0.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace packet::tools {

struct NpyHeader {
    std::string descr;  ///< the element type: "<f4" is a little-endian float
    bool fortran_order = false;
    std::vector<std::uint64_t> shape;
};

/// Reads the dictionary of a file's header. Throws Error{kBadFile} that names `file` and the place
/// if it is malformed, if a key is missing, unknown or there twice, or if the type is a record.
[[nodiscard]] NpyHeader parse_npy_header(std::string_view text, std::string_view file);

/// Everything that precedes an array's data in a version 1.0 file. `descr` and `shape` are Python
/// source: "'<f4'" and "(3, 8)".
[[nodiscard]] std::string format_npy_header(std::string_view descr, std::string_view shape);

}  // namespace packet::tools
