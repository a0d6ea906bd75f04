// What is wrong with a command line, as opposed to the data it names.
#pragma once

#include <packet/error.h>

#include <string>

namespace packet::tools {

/// The arguments are at fault, not the data: the program then exits with 2 instead of 1.
class UsageError : public Error {
public:
    explicit UsageError(const std::string& message) : Error(ErrorCode::kBadValue, message) {}
};

}  // namespace packet::tools
