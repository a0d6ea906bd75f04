// Files that appear under their name only when they are complete.
#include "output_file.h"

#include <packet/error.h>

#include <unistd.h>
#include <cerrno>
#include <string>
#include <system_error>

namespace packet::tools {
namespace {

[[noreturn]] void fail(const std::filesystem::path& target, int error) {
    throw Error(ErrorCode::kIo, "cannot write '" + target.string() +
                                    "': " + std::generic_category().message(error));
}

/// Follows links, so that a link to the target stays one.
std::filesystem::path resolve(const std::filesystem::path& target) {
    std::error_code error;
    std::filesystem::path resolved = std::filesystem::weakly_canonical(target, error);
    return error ? target : resolved;
}

std::filesystem::path temporary_of(const std::filesystem::path& target) {
    std::error_code ignored;
    const std::filesystem::file_type type = std::filesystem::status(target, ignored).type();
    const bool replaceable = type == std::filesystem::file_type::regular ||
                             type == std::filesystem::file_type::not_found;
    if (!replaceable) return target;
    return target.string() + "." + std::to_string(::getpid()) + ".part";
}

}  // namespace

OutputFile::OutputFile(const std::filesystem::path& target)
    : target_(resolve(target)), temporary_(temporary_of(target_)) {
    file_.reset(std::fopen(temporary_.c_str(), "wb"));
    if (!file_) fail(target, errno);
}

OutputFile::~OutputFile() {
    if (!file_ || temporary_ == target_) return;
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
}

void OutputFile::write(std::span<const std::byte> bytes) {
    if (bytes.empty()) return;  // fwrite takes no null pointer, not even to nothing
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) {
        fail(target_, errno);
    }
}

void OutputFile::commit() {
    if (std::fflush(file_.get()) != 0) fail(target_, errno);
    if (temporary_ != target_ && std::rename(temporary_.c_str(), target_.c_str()) != 0) {
        fail(target_, errno);
    }
    file_.reset();
}

}  // namespace packet::tools
