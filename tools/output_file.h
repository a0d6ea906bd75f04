// Files that appear under their name only when they are complete.
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace packet::tools {

/// A file being written under a temporary name beside its target. commit() gives it the target's
/// name; without it nothing stays. A target that is there and no regular file (a device, a pipe) is
/// written directly. Everything that fails throws Error{kIo} that names the target.
class OutputFile {
public:
    explicit OutputFile(const std::filesystem::path& target);
    OutputFile(OutputFile&& other) noexcept = default;
    OutputFile& operator=(OutputFile&&) = delete;
    ~OutputFile();

    void write(std::span<const std::byte> bytes);
    void write(std::string_view text) { write(std::as_bytes(std::span(text))); }
    /// The last call: the file is complete.
    void commit();

private:
    struct Close {
        void operator()(std::FILE* file) const noexcept { std::fclose(file); }
    };

    std::filesystem::path target_;
    std::filesystem::path temporary_;  // equal to target_ if that is written directly
    std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace packet::tools
