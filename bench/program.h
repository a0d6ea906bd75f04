// The main function that programs share.
#pragma once

#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>

namespace packet::bench {

/// Parses the command line and returns run(), the exit code: by custom 0, or 1 for a result that is
/// bad. So does any other error; a wrong command line gives 2.
template <class Run>
int run_program(CLI::App& app, int argc, char** argv, Run run) {
    try {
        app.parse(argc, argv);
        return run();
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), error.what());
        return 1;
    }
}

}  // namespace packet::bench
