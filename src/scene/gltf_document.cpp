// Takes a .glb apart, has tinygltf read its JSON, and gathers the buffers.
//
// Khronos Group. glTF 2.0 specification, section 4: GLB file format. 2021.
#include "scene/gltf_document.h"

#include "scene/gltf_filter.h"
#include "scene/gltf_uri.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace packet::gltf {
namespace {

using Bytes = std::span<const std::byte>;

constexpr std::string_view kMagic = "glTF";
constexpr std::size_t kHeaderSize = 12;
constexpr std::size_t kChunkHeaderSize = 8;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004E4942;  // "BIN"

// With one of these required, what the file holds without it is not the scene that was meant.
constexpr std::array<std::string_view, 4> kUnreadExtensions = {
    "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression",
    "EXT_mesh_gpu_instancing"};

std::string_view as_text(Bytes bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::uint32_t read_u32(Bytes bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) {
        value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + i]);
    }
    return value;
}

struct Chunks {
    std::string_view json;
    std::optional<Bytes> binary;
};

/// The bytes of the chunk that begins at `at`. All sums are of 64 bits and cannot wrap.
Bytes read_chunk(Bytes file, std::size_t at, const FileErrors& errors) {
    if (file.size() < at + kChunkHeaderSize) errors.fail("the chunk at byte ", at, " is cut off");
    const std::size_t size = read_u32(file, at);
    const std::size_t rest = file.size() - at - kChunkHeaderSize;
    if (size > rest) {
        errors.fail("the chunk at byte ", at, " has ", size, " bytes, but ", rest, " are left");
    }
    return file.subspan(at + kChunkHeaderSize, size);
}

Chunks split_glb(Bytes file, const FileErrors& errors) {
    if (file.size() < kHeaderSize) errors.fail("is cut off within the header");
    const std::uint32_t version = read_u32(file, 4);
    if (version != 2) errors.fail("is binary glTF ", version, ", but only 2 is read");
    const std::size_t length = read_u32(file, 8);
    if (length > file.size()) {
        errors.fail("should have ", length, " bytes, but has ", file.size());
    }
    file = file.first(length);

    Chunks chunks;
    const Bytes json = read_chunk(file, kHeaderSize, errors);
    if (read_u32(file, kHeaderSize + 4) != kJsonChunk) errors.fail("its first chunk is not JSON");
    chunks.json = as_text(json);
    for (std::size_t at = kHeaderSize + kChunkHeaderSize + json.size(); at < file.size();) {
        const Bytes chunk = read_chunk(file, at, errors);
        if (read_u32(file, at + 4) == kBinaryChunk && !chunks.binary) chunks.binary = chunk;
        at += kChunkHeaderSize + chunk.size();
    }
    return chunks;
}

Chunks split(Bytes file, const std::filesystem::path& path, const FileErrors& errors) {
    if (as_text(file).starts_with(kMagic)) return split_glb(file, errors);
    if (path.extension() == ".glb")
        errors.fail("does not begin with 'glTF', so it is no .glb file");
    return {as_text(file), std::nullopt};
}

void check_extensions(const FilteredJson& filtered, const FileErrors& errors) {
    for (const std::string_view name : kUnreadExtensions) {
        if (std::ranges::count(filtered.required_extensions, name) != 0) {
            errors.fail_as(ErrorCode::kUnsupported, "requires the extension ", name,
                           ", which cannot be read");
        }
    }
}

/// Says which object tinygltf stopped at. It reads buffer views, accessors and meshes in this
/// order, then looks at the primitives' indices.
[[noreturn]] void fail_parse(const FilteredJson& filtered, const tinygltf::Model& model,
                             std::string reason, const FileErrors& errors) {
    // It quotes the file, which may hold anything.
    constexpr std::size_t kLongestReason = 120;
    reason.resize(std::min({reason.find('\n'), reason.size(), kLongestReason}));
    std::ranges::replace_if(
        reason, [](char c) { return c < ' ' || c > '~'; }, '?');
    if (model.bufferViews.size() < filtered.buffer_view_count) {
        errors.fail("buffer view ", model.bufferViews.size(), ": ", reason);
    }
    if (model.accessors.size() < filtered.accessor_count) {
        errors.fail("accessor ", model.accessors.size(), ": ", reason);
    }
    for (std::size_t mesh = 0; mesh < model.meshes.size(); ++mesh) {
        for (const tinygltf::Primitive& primitive : model.meshes[mesh].primitives) {
            const auto accessor = static_cast<std::size_t>(primitive.indices);
            if (primitive.indices >= 0 && accessor >= model.accessors.size()) {
                errors.fail("mesh ", mesh, ": its indices are in accessor ", accessor,
                            ", but there are ", model.accessors.size());
            }
        }
    }
    errors.fail(reason);
}

tinygltf::Model parse_model(const FilteredJson& filtered, const FileErrors& errors) {
    // tinygltf counts the bytes of JSON in 32 bits.
    if (filtered.json.size() > std::numeric_limits<unsigned>::max()) {
        errors.fail_as(ErrorCode::kTooLarge, "its JSON has more than 4 GiB");
    }
    tinygltf::Model model;
    std::string error;
    std::string warning;
    tinygltf::TinyGLTF parser;
    const bool ok = parser.LoadASCIIFromString(&model, &error, &warning, filtered.json.data(),
                                               static_cast<unsigned>(filtered.json.size()), "");
    // It may leave out an object, note so, and yet succeed.
    if (!ok || !error.empty()) fail_parse(filtered, model, error, errors);
    if (!model.asset.version.starts_with("2.")) {
        errors.fail("its asset.version is not 2.x, which alone is read");
    }
    return model;
}

/// Gathers the bytes of a document's buffers.
class BufferReader {
public:
    BufferReader(Document& document, const std::filesystem::path& folder)
        : document_(document), folder_(folder) {}

    void read(const BufferSource& source, std::optional<Bytes> binary_chunk) {
        const std::size_t id = document_.buffers.size();
        const Bytes bytes = !source.uri                ? chunk(binary_chunk)
                            : is_data_uri(*source.uri) ? data(*source.uri)
                                                       : file(*source.uri);
        if (bytes.size() < source.byte_length) {
            document_.errors.fail("buffer ", id, ": should have ", source.byte_length,
                                  " bytes, but has ", bytes.size());
        }
        document_.buffers.push_back(bytes.first(source.byte_length));
    }

private:
    Bytes chunk(std::optional<Bytes> binary_chunk) {
        const std::size_t id = document_.buffers.size();
        if (!binary_chunk || id != 0) {
            document_.errors.fail("buffer ", id, ": has no URI and is not the binary chunk");
        }
        document_.byte_count += binary_chunk->size();
        return *binary_chunk;
    }

    Bytes data(std::string_view uri) {
        return keep(decode_data_uri(uri, document_.buffers.size(), document_.errors));
    }

    /// Reads each file once, however many buffers name it.
    Bytes file(std::string_view uri) {
        const std::filesystem::path path =
            resolve_file_uri(uri, document_.buffers.size(), document_.errors);
        const auto [place, is_new] = files_.try_emplace(path);
        if (!is_new) return place->second;
        try {
            return place->second = keep(read_file(folder_ / path));
        } catch (const Error& error) {
            document_.errors.fail_as(error.code(), "buffer ", document_.buffers.size(), ": ",
                                     error.what());
        }
    }

    Bytes keep(std::vector<std::byte> bytes) {
        document_.byte_count += bytes.size();
        return document_.storage.emplace_back(std::move(bytes));
    }

    Document& document_;
    const std::filesystem::path& folder_;
    std::map<std::filesystem::path, Bytes> files_;
};

[[noreturn]] void fail_io(const std::filesystem::path& path, const std::string& reason) {
    throw Error(ErrorCode::kIo, "cannot read '" + path.string() + "': " + reason);
}

}  // namespace

std::vector<std::byte> read_file(const std::filesystem::path& path) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    // A pipe or device could block for ever.
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
        fail_io(path, "not a regular file");
    }
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    if (error) fail_io(path, error.message());

    std::ifstream stream(path, std::ios::binary);
    if (!stream) fail_io(path, std::generic_category().message(errno));
    std::vector<std::byte> bytes(size);
    stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
    if (static_cast<std::uintmax_t>(stream.gcount()) != size) fail_io(path, "it shrank meanwhile");
    return bytes;
}

Document read_document(Bytes bytes, const std::filesystem::path& path) {
    Document document{FileErrors(path.string()), {}, {}, {}, 0};
    const Chunks chunks = split(bytes, path, document.errors);
    const FilteredJson filtered = filter_json(chunks.json, document.errors);
    check_extensions(filtered, document.errors);
    document.model = parse_model(filtered, document.errors);
    document.byte_count = chunks.json.size();
    const std::filesystem::path folder = path.parent_path();
    BufferReader reader(document, folder);
    for (const BufferSource& source : filtered.buffers) reader.read(source, chunks.binary);
    return document;
}

}  // namespace packet::gltf
