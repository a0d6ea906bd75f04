// The packet program: reads the command line, runs a command, and turns what goes wrong into a
// message on stderr and an exit code: 2 if the command line is at fault, 1 for anything else.
#include "commands.h"
#include "usage_error.h"

#include <packet/version.h>

#include <fmt/format.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <sstream>
#include <string>

namespace packet::tools {
namespace {

constexpr int kFailure = 1, kUsageFailure = 2;

constexpr const char* kExamples = R"(Examples:
  packet make city -o city.glb --triangles 1000000
  packet info city.glb
  packet render city.glb -o city.png --shading ao
  packet rays city.glb diffuse -o rays.npy --size 1024x1024
  packet trace city.glb rays.npy -o hits.npy --repeat 5

'packet COMMAND --help' shows a command's options.)";

std::string version() {
    return fmt::format("packet {}.{}.{}", PACKET_VERSION_MAJOR, PACKET_VERSION_MINOR,
                       PACKET_VERSION_PATCH);
}

/// Names the valid commands, which CLI11 does not.
void check_command(const CLI::App& app, const std::string& word) {
    std::string names;
    for (const CLI::App* command : app.get_subcommands(nullptr)) {
        if (word == command->get_name()) return;
        names.append(names.empty() ? "" : ", ").append(command->get_name());
    }
    throw UsageError("unknown command '" + word + "'; valid are: " + names);
}

int fail(const std::string& message, int exit_code) {
    fmt::print(stderr, "packet: {}\n", message);
    return exit_code;
}

int run(int argc, char** argv) {
    CLI::App app("Traces rays through triangle meshes on the CPU", "packet");
    app.require_subcommand(0, 1);
    app.set_version_flag("--version", version());
    add_info_command(app);
    add_render_command(app);
    add_trace_command(app);
    add_rays_command(app);
    add_make_command(app);
    app.footer(kExamples);  // last, as commands inherit what is there when they are added
    if (argc < 2) {
        print(app.help());
        return 0;
    }
    if (argv[1][0] != '-') check_command(app, argv[1]);
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& help_or_version) {
        std::ostringstream text;
        app.exit(help_or_version, text, text);
        print(text.str());
    } catch (const CLI::ParseError& error) {
        return fail(std::string(error.what()) + "\nRun with --help for the options.",
                    kUsageFailure);
    }
    return 0;
}

int exit_code(const Error& error) {
    // A name comes from the command line or from PACKET_ISA, never from a file.
    const bool is_usage = error.code() == ErrorCode::kUnknownName ||
                          error.code() == ErrorCode::kUnsupported ||
                          dynamic_cast<const UsageError*>(&error) != nullptr;
    return is_usage ? kUsageFailure : kFailure;
}

}  // namespace

void print(std::string_view text) {
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() ||
        std::fflush(stdout) != 0) {
        throw Error(ErrorCode::kIo, std::string("cannot write to stdout: ") + std::strerror(errno));
    }
}

}  // namespace packet::tools

int main(int argc, char** argv) {
    using namespace packet::tools;
    std::signal(SIGPIPE, SIG_IGN);  // a reader that has gone is an error of writing, with a message
    try {
        return run(argc, argv);
    } catch (const packet::Error& error) {
        return fail(error.what(), exit_code(error));
    } catch (const std::bad_alloc&) {
        return fail("out of memory", kFailure);
    } catch (const std::exception& error) {
        return fail(error.what(), kFailure);
    }
}
