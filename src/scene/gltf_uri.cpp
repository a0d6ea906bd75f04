// Berners-Lee, Fielding, Masinter. Uniform Resource Identifier (URI): generic syntax. RFC 3986,
// 2005. Masinter. The "data" URL scheme. RFC 2397, 1998.
#include "scene/gltf_uri.h"

#include <array>
#include <cstdint>
#include <string>

namespace packet::gltf {
namespace {

constexpr std::string_view kDataScheme = "data:";
constexpr std::string_view kBase64Mark = ";base64,";
constexpr std::uint8_t kNoDigit = 0xFF;

consteval std::array<std::uint8_t, 256> make_base64_digits() {
    constexpr std::string_view kAlphabet =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::array<std::uint8_t, 256> digits{};
    digits.fill(kNoDigit);
    for (std::size_t i = 0; i < kAlphabet.size(); ++i) {
        digits[static_cast<std::uint8_t>(kAlphabet[i])] = static_cast<std::uint8_t>(i);
    }
    return digits;
}
constexpr std::array<std::uint8_t, 256> kBase64Digits = make_base64_digits();

/// The digit's value, or -1.
int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/// Replaces each %41 by what it stands for. A stray percent sign stays, as exporters write such
/// names.
std::string decode_percent(std::string_view uri) {
    std::string text;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const int high = uri[i] == '%' && i + 2 < uri.size() ? hex_digit(uri[i + 1]) : -1;
        const int low = high >= 0 ? hex_digit(uri[i + 2]) : -1;
        text += low >= 0 ? static_cast<char>(high * 16 + low) : uri[i];
        if (low >= 0) i += 2;
    }
    return text;
}

/// Whether it begins with a scheme, as in "http:" (or a drive, as in "C:").
bool has_scheme(std::string_view uri) {
    const std::size_t end = uri.find_first_of(":/?#");
    return end != uri.npos && uri[end] == ':';
}

}  // namespace

bool is_data_uri(std::string_view uri) { return uri.starts_with(kDataScheme); }

std::vector<std::byte> decode_data_uri(std::string_view uri, std::size_t buffer_id,
                                       const FileErrors& errors) {
    const std::size_t comma = uri.find(',');
    if (comma == uri.npos || !uri.substr(0, comma + 1).ends_with(kBase64Mark)) {
        errors.fail("buffer ", buffer_id, ": its data URI is not in base64");
    }
    std::string_view digits = uri.substr(comma + 1);
    for (int i = 0; i < 2 && digits.ends_with('='); ++i) digits.remove_suffix(1);
    // A single digit has 6 bits, less than a byte.
    if (digits.size() % 4 == 1) errors.fail("buffer ", buffer_id, ": its data URI is cut off");

    std::vector<std::byte> bytes;
    bytes.reserve(digits.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int bit_count = 0;
    for (const char c : digits) {
        const std::uint8_t digit = kBase64Digits[static_cast<std::uint8_t>(c)];
        if (digit == kNoDigit) {
            errors.fail("buffer ", buffer_id, ": its data URI has a character that is not base64");
        }
        bits = bits << 6 | digit;
        bit_count += 6;
        if (bit_count < 8) continue;
        bit_count -= 8;
        bytes.push_back(static_cast<std::byte>(bits >> bit_count & 0xFFu));
    }
    return bytes;
}

std::filesystem::path resolve_file_uri(std::string_view uri, std::size_t buffer_id,
                                       const FileErrors& errors) {
    if (has_scheme(uri))
        errors.fail("buffer ", buffer_id, ": its URI is neither data nor a file's");
    const std::string name = decode_percent(uri);
    std::filesystem::path path = std::filesystem::path(name).lexically_normal();
    if (name.empty() || name.find('\0') != name.npos || !path.has_filename()) {
        errors.fail("buffer ", buffer_id, ": its URI names no file");
    }
    if (path.has_root_path() || *path.begin() == "..") {
        errors.fail("buffer ", buffer_id, ": its URI leads out of the glTF file's folder");
    }
    return path;
}

}  // namespace packet::gltf
