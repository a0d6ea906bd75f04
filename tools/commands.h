// The commands of the program. Each adds itself to the command line: its options, and what runs
// once all of the command line has been read.
#pragma once

#include <CLI/CLI.hpp>

#include <string_view>

namespace packet::tools {

void add_info_command(CLI::App& program);
void add_render_command(CLI::App& program);
void add_trace_command(CLI::App& program);
void add_rays_command(CLI::App& program);
void add_make_command(CLI::App& program);

/// Writes to stdout, at once. Throws Error{kIo} if it cannot, for instance as nobody reads it.
void print(std::string_view text);

}  // namespace packet::tools
