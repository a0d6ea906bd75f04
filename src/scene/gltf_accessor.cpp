#include "scene/gltf_accessor.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>

namespace packet::gltf {
namespace {

using Bytes = std::span<const std::byte>;

/// Elements at equal distances, all of them inside of their buffer.
struct Elements {
    const std::byte* first;
    std::size_t stride;

    const std::byte* operator[](std::size_t i) const { return first + i * stride; }
};

/// What of an accessor is at stake, for errors.
struct Part {
    int accessor_id;
    const char* name;
};

std::ostream& operator<<(std::ostream& out, const Part& part) {
    return out << "accessor " << part.accessor_id << part.name;
}

Bytes view_bytes(const Document& document, int view_id, const Part& part) {
    const auto& views = document.model.bufferViews;
    const auto id = static_cast<std::size_t>(view_id);
    if (view_id < 0 || id >= views.size()) {
        document.errors.fail(part, ": is in buffer view ", view_id, ", but there are ",
                             views.size());
    }
    const tinygltf::BufferView& view = views[id];
    const auto buffer_id = static_cast<std::size_t>(view.buffer);
    if (view.buffer < 0 || buffer_id >= document.buffers.size()) {
        document.errors.fail("buffer view ", view_id, ": is in buffer ", view.buffer,
                             ", but there are ", document.buffers.size());
    }
    const Bytes buffer = document.buffers[buffer_id];
    if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset) {
        document.errors.fail("buffer view ", view_id, ": needs ", view.byteLength, " bytes from ",
                             view.byteOffset, " on of buffer ", buffer_id, ", which has ",
                             buffer.size());
    }
    return buffer.subspan(view.byteOffset, view.byteLength);
}

/// How far apart elements are: their size, or what their buffer view says.
enum class Spacing : std::uint8_t { kTight, kByView };

/// `count` elements of `size` bytes from `offset` on in a view. Nothing here can wrap.
Elements find_elements(const Document& document, int view_id, std::size_t offset, std::size_t count,
                       std::size_t size, Spacing spacing, const Part& part) {
    const Bytes bytes = view_bytes(document, view_id, part);
    std::size_t stride = document.model.bufferViews[static_cast<std::size_t>(view_id)].byteStride;
    if (spacing == Spacing::kTight || stride == 0) stride = size;
    if (count == 0) return {bytes.data(), stride};
    if (stride < size) {
        document.errors.fail(part, ": has elements of ", size, " bytes, but a stride of ", stride);
    }
    const std::size_t room = bytes.size() < offset ? 0 : bytes.size() - offset;
    if (room < size || (room - size) / stride < count - 1) {
        document.errors.fail(part, ": needs ", count, " elements of ", size, " bytes, ", stride,
                             " apart, from byte ", offset, " on of buffer view ", view_id,
                             ", which has ", bytes.size());
    }
    return {bytes.data() + offset, stride};
}

template <class T>
T load(const std::byte* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof(T));  // files are little-endian, as are all hosts served
    return value;
}

struct DecodeFloats {
    static constexpr std::size_t kSize = 12;
    glm::vec3 operator()(const std::byte* bytes) const {
        return {load<float>(bytes), load<float>(bytes + 4), load<float>(bytes + 8)};
    }
};

/// Components of 8 or 16 bits; normalized ones stand for -1..1 or 0..1.
template <class T>
struct DecodeIntegers {
    static constexpr std::size_t kSize = 3 * sizeof(T);
    bool is_normalized;

    float component(const std::byte* bytes) const {
        const auto value = static_cast<float>(load<T>(bytes));
        // The most negative integer would be below -1.
        constexpr auto kOne = static_cast<float>(std::numeric_limits<T>::max());
        return is_normalized ? std::max(value / kOne, -1.0f) : value;
    }
    glm::vec3 operator()(const std::byte* bytes) const {
        return {component(bytes), component(bytes + sizeof(T)), component(bytes + 2 * sizeof(T))};
    }
};

template <class T>
struct DecodeIndex {
    static constexpr std::size_t kSize = sizeof(T);
    std::uint32_t operator()(const std::byte* bytes) const { return load<T>(bytes); }
};

/// Calls `use` with a decoder of unsigned integers of a component type, or fails.
template <class Use>
auto with_index_decoder(int component_type, const Document& document, const Part& part, Use use) {
    switch (component_type) {
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return use(DecodeIndex<std::uint8_t>{});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return use(DecodeIndex<std::uint16_t>{});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return use(DecodeIndex<std::uint32_t>{});
        default: break;
    }
    document.errors.fail(part, ": component type ", component_type,
                         " is not one of 8, 16 or 32 bits without sign");
}

/// Replaces some elements by others, as a sparse accessor asks.
template <class Out, class Decode>
void apply_sparse(const Document& document, const tinygltf::Accessor& accessor, int accessor_id,
                  Decode decode, std::vector<Out>& out) {
    const auto& sparse = accessor.sparse;
    const auto count = static_cast<std::size_t>(sparse.count);
    const Part index_part{accessor_id, ", sparse indices"};
    if (count > out.size()) {
        document.errors.fail(index_part, ": are ", count, " for ", out.size(), " elements");
    }
    const Elements values = find_elements(
        document, sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset),
        count, Decode::kSize, Spacing::kTight, {accessor_id, ", sparse values"});
    with_index_decoder(sparse.indices.componentType, document, index_part, [&](auto decode_index) {
        const Elements indices =
            find_elements(document, sparse.indices.bufferView,
                          static_cast<std::size_t>(sparse.indices.byteOffset), count,
                          decode_index.kSize, Spacing::kTight, index_part);
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint32_t index = decode_index(indices[i]);
            if (index >= out.size()) {
                document.errors.fail(index_part, ": the one at ", i, " is ", index,
                                     ", but there are ", out.size(), " elements");
            }
            out[index] = decode(values[i]);
        }
    });
}

}  // namespace

const tinygltf::Accessor& AccessorReader::find(int accessor_id) const {
    const auto& accessors = document_.model.accessors;
    if (accessor_id < 0 || static_cast<std::size_t>(accessor_id) >= accessors.size()) {
        document_.errors.fail("accessor ", accessor_id, ": is referred to, but there are ",
                              accessors.size());
    }
    return accessors[static_cast<std::size_t>(accessor_id)];
}

template <class Decode>
auto AccessorReader::read(int accessor_id, Decode decode) {
    using Out = std::invoke_result_t<Decode, const std::byte*>;
    const tinygltf::Accessor& accessor = find(accessor_id);
    const bool is_stored = accessor.bufferView >= 0;
    Elements elements{};
    if (is_stored) {
        elements =
            find_elements(document_, accessor.bufferView, accessor.byteOffset, accessor.count,
                          Decode::kSize, Spacing::kByView, {accessor_id, ""});
    }
    budget_.charge(accessor.count, sizeof(Out), "accessor ", accessor_id, ", elements");
    std::vector<Out> out(accessor.count);  // zeros, unless the file stores something else
    for (std::size_t i = 0; is_stored && i < out.size(); ++i) out[i] = decode(elements[i]);
    if (accessor.sparse.isSparse) apply_sparse(document_, accessor, accessor_id, decode, out);
    return out;
}

std::vector<glm::vec3> AccessorReader::read_positions(int accessor_id) {
    const tinygltf::Accessor& accessor = find(accessor_id);
    const bool is_normalized = accessor.normalized;
    if (accessor.type != TINYGLTF_TYPE_VEC3) {
        document_.errors.fail("accessor ", accessor_id, ": holds positions, but is no VEC3");
    }
    switch (accessor.componentType) {
        case TINYGLTF_COMPONENT_TYPE_FLOAT: return read(accessor_id, DecodeFloats{});
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return read(accessor_id, DecodeIntegers<std::int8_t>{is_normalized});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return read(accessor_id, DecodeIntegers<std::uint8_t>{is_normalized});
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return read(accessor_id, DecodeIntegers<std::int16_t>{is_normalized});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return read(accessor_id, DecodeIntegers<std::uint16_t>{is_normalized});
        default: break;
    }
    document_.errors.fail("accessor ", accessor_id, ": holds positions of component type ",
                          accessor.componentType, ", which is neither float nor 8 or 16 bits");
}

std::vector<std::uint32_t> AccessorReader::read_indices(int accessor_id) {
    const tinygltf::Accessor& accessor = find(accessor_id);
    if (accessor.type != TINYGLTF_TYPE_SCALAR) {
        document_.errors.fail("accessor ", accessor_id, ": holds indices, but is no SCALAR");
    }
    return with_index_decoder(accessor.componentType, document_, {accessor_id, ""},
                              [&](auto decode) { return read(accessor_id, decode); });
}

}  // namespace packet::gltf
