// How the glTF loader reports what is wrong with a file, and how it bounds what a file may cost.
#pragma once

#include <packet/error.h>

#include <algorithm>
#include <cstddef>
#include <locale>
#include <sstream>
#include <string>
#include <utility>

namespace packet::gltf {

/// Throws errors that begin with a file's name: `scene.gltf: accessor 3: needs bytes ...`.
class FileErrors {
public:
    explicit FileErrors(std::string file_name) : file_name_(std::move(file_name)) {}

    /// Throws Error{kBadFile} with the parts written one after another.
    template <class... Parts>
    [[noreturn]] void fail(const Parts&... parts) const {
        fail_as(ErrorCode::kBadFile, parts...);
    }
    template <class... Parts>
    [[noreturn]] void fail_as(ErrorCode code, const Parts&... parts) const {
        std::ostringstream message;
        message.imbue(std::locale::classic());
        ((message << file_name_ << ": ") << ... << parts);
        throw Error(code, message.str());
    }

private:
    std::string file_name_;
};

/// Bounds the memory of a scene by the size of its file. Accessors may overlap, be used by many
/// primitives, or stand for zeros that are stored nowhere: without a bound, a few kilobytes could
/// ask for terabytes.
class MemoryBudget {
public:
    /// For a file of `file_bytes`. Throws Error{kTooLarge} by way of `errors`, which it keeps.
    MemoryBudget(std::size_t file_bytes, const FileErrors& errors)
        : left_(kFree + kPerByte * std::min(file_bytes, kMaxFileBytes)), errors_(&errors) {}

    /// To be called before elements are allocated. Whether the budget allows for so many.
    [[nodiscard]] bool take(std::size_t count, std::size_t element_size) {
        if (count > left_ / element_size) return false;
        left_ -= count * element_size;
        return true;
    }
    /// The same, or throws; the parts say what was to be allocated.
    template <class... Parts>
    void charge(std::size_t count, std::size_t element_size, const Parts&... parts) {
        if (take(count, element_size)) return;
        errors_->fail_as(ErrorCode::kTooLarge, parts..., ": ", count, " of ", element_size,
                         " bytes are more than a file of this size may fill");
    }

private:
    // No encoding grows by more than 16 (a strip of 8-bit indices: 4 bytes while it is read, 12 for
    // the triangle), and 60 bytes a vertex come of 44 in common files. The rest is for geometry
    // that several meshes share, say because each has another material.
    static constexpr std::size_t kPerByte = 64;
    static constexpr std::size_t kFree = std::size_t{256} << 20;
    static constexpr std::size_t kMaxFileBytes = std::size_t{1} << 48;  // the product must not wrap

    std::size_t left_;
    const FileErrors* errors_;
};

}  // namespace packet::gltf
