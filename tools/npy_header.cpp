// Reads and writes the header of a NumPy array file.
#include "npy_header.h"

#include <packet/error.h>

#include <algorithm>
#include <charconv>
#include <utility>

namespace packet::tools {
namespace {

/// Reads a text from front to back and says where it is wrong.
class Reader {
public:
    Reader(std::string_view text, std::string_view file) : text_(text), file_(file) {}

    [[noreturn]] void fail(std::string_view expected) const {
        throw Error(ErrorCode::kBadFile, "'" + std::string(file_) + "': bad NPY header: expected " +
                                             std::string(expected) + " at byte " +
                                             std::to_string(at_) + " of the dictionary");
    }

    /// Skips white space, then takes `token` if it is next.
    bool accept(std::string_view token) {
        at_ = std::min(text_.find_first_not_of(" \t\n", at_), text_.size());
        if (text_.substr(at_, token.size()) != token) return false;
        at_ += token.size();
        return true;
    }
    void expect(std::string_view token) {
        if (!accept(token)) fail("'" + std::string(token) + "'");
    }
    std::string quoted(std::string_view what) {
        const std::string_view quote = accept("'") ? "'" : "\"";
        if (quote == "\"" && !accept(quote)) fail(what);
        const std::size_t end = text_.find(quote, at_);
        if (end == std::string_view::npos) fail("a closing quote");
        const std::size_t begin = at_;
        at_ = end + 1;
        return std::string(text_.substr(begin, end - begin));
    }
    std::uint64_t number() {
        accept("");
        std::uint64_t value = 0;
        const char* const begin = text_.data() + at_;
        const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), value);
        if (error != std::errc{}) fail("a number below 2^64");
        at_ += static_cast<std::size_t>(end - begin);
        return value;
    }
    void expect_end() {
        accept("");
        if (at_ != text_.size()) fail("the end");
    }

private:
    std::string_view text_;
    std::string_view file_;
    std::size_t at_ = 0;
};

std::vector<std::uint64_t> read_shape(Reader& reader) {
    std::vector<std::uint64_t> shape;
    reader.expect("(");
    while (!reader.accept(")")) {
        shape.push_back(reader.number());
        if (reader.accept(")")) break;
        reader.expect(",");
    }
    return shape;
}

bool read_bool(Reader& reader) {
    if (reader.accept("True")) return true;
    reader.expect("False");
    return false;
}

}  // namespace

NpyHeader parse_npy_header(std::string_view text, std::string_view file) {
    NpyHeader header;
    Reader reader(text, file);
    bool has_descr = false, has_order = false, has_shape = false;
    const auto first = [&](bool& has) {
        if (std::exchange(has, true)) reader.fail("each key once");
    };
    reader.expect("{");
    while (!reader.accept("}")) {
        const std::string key = reader.quoted("a key");
        reader.expect(":");
        if (key == "descr") {
            first(has_descr);
            header.descr = reader.quoted("a plain element type");
        } else if (key == "fortran_order") {
            first(has_order);
            header.fortran_order = read_bool(reader);
        } else if (key == "shape") {
            first(has_shape);
            header.shape = read_shape(reader);
        } else {
            reader.fail("only the keys descr, fortran_order and shape");
        }
        if (reader.accept("}")) break;
        reader.expect(",");
    }
    reader.expect_end();
    if (!has_descr || !has_order || !has_shape) reader.fail("descr, fortran_order and shape");
    return header;
}

std::string format_npy_header(std::string_view descr, std::string_view shape) {
    std::string dictionary = "{'descr': ";
    dictionary.append(descr).append(", 'fortran_order': False, 'shape': ");
    dictionary.append(shape).append(", }");

    // Magic, version and length take 10 bytes; spaces and a newline end the header on a multiple of
    // 64, so that the data can be mapped aligned.
    constexpr std::size_t kPrefix = 10, kAlignment = 64;
    const std::size_t used = kPrefix + dictionary.size() + 1;
    dictionary.append((kAlignment - used % kAlignment) % kAlignment, ' ').push_back('\n');

    std::string header("\x93NUMPY\x01\x00", 8);
    header.push_back(static_cast<char>(dictionary.size() & 0xFF));
    header.push_back(static_cast<char>(dictionary.size() >> 8));
    return header + dictionary;
}

}  // namespace packet::tools
