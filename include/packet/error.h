// The one exception type of the library.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace packet {

enum class ErrorCode : std::uint8_t {
    kBadIndex,      // an index points outside of what it indexes
    kBadValue,      // a value outside its documented range
    kBadFile,       // a file that is truncated, malformed or not what it claims to be
    kIo,            // the operating system refused to open, read or write
    kTooLarge,      // more of something than the library's 31-bit references can name
    kUnknownName,   // a name that is not in the list the message gives
    kUnsupported,   // a known name that this CPU or build cannot serve
    kNotCommitted,  // a scene that was traced before Scene::commit()
    kCancelled      // a build that its progress report ended
};

/// Thrown for bad data. The message says what was wrong, where, and at which index.
/// Whatever threw it left its arguments and the scene as they were.
class Error : public std::runtime_error {
public:
    Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
    [[nodiscard]] ErrorCode code() const noexcept { return code_; }

private:
    ErrorCode code_;
};

}  // namespace packet
