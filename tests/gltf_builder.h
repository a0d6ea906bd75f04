// Writes small glTF files for the tests of the loader.
#pragma once

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

namespace packet::test {

inline std::span<const std::byte> as_bytes(std::string_view text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

template <class T>
std::string bytes_of(std::span<const T> values) {
    return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}
template <class T>
std::string bytes_of(std::initializer_list<T> values) {
    return bytes_of(std::span<const T>(values.begin(), values.size()));
}

inline std::string base64(std::string_view bytes) {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            bits =
                bits << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0u);
        }
        for (std::size_t k = 0; k < 4; ++k) {
            text += i + k > bytes.size() ? '=' : kDigits[bits >> (18 - 6 * k) & 63u];
        }
    }
    return text;
}

inline std::string replaced(std::string text, std::string_view from, std::string_view to) {
    const std::size_t at = text.find(from);
    return at == text.npos ? "" : text.replace(at, from.size(), to);  // "" makes the test fail
}

/// A .glb of a JSON chunk and, unless it is empty, a binary chunk.
inline std::string make_glb(std::string json, std::string binary) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    const auto u32 = [](std::size_t value) {
        return bytes_of({static_cast<std::uint32_t>(value)});
    };
    std::string chunks = u32(json.size()) + "JSON" + json;
    if (!binary.empty()) chunks += u32(binary.size()) + std::string("BIN\0", 4) + binary;
    return "glTF" + u32(2) + u32(12 + chunks.size()) + chunks;
}

/// Gathers the parts of a document. Those that refer to others take plain JSON.
class GltfBuilder {
public:
    static constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123,
                         kUnsignedInt = 5125, kFloat = 5126;

    int view(const std::string& bytes, int stride = 0) {
        binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
        std::string json = R"({"buffer":0,"byteOffset":)" + std::to_string(binary_.size()) +
                           R"(,"byteLength":)" + std::to_string(bytes.size());
        if (stride != 0) json += R"(,"byteStride":)" + std::to_string(stride);
        binary_ += bytes;
        return views_.add(json + "}");
    }
    /// `rest` is what else it has, beginning with a comma.
    int accessor(int component_type, const std::string& type, std::size_t count,
                 const std::string& rest) {
        return accessors_.add(R"({"componentType":)" + std::to_string(component_type) +
                              R"(,"type":")" + type + R"(","count":)" + std::to_string(count) +
                              rest + "}");
    }
    int positions(std::initializer_list<glm::vec3> points) {
        return accessor(kFloat, "VEC3", points.size(), in_view(view(bytes_of(points))));
    }
    template <class T>
    int indices(std::initializer_list<T> values) {
        constexpr int kType = sizeof(T) == 1   ? kUnsignedByte
                              : sizeof(T) == 2 ? kUnsignedShort
                                               : kUnsignedInt;
        return accessor(kType, "SCALAR", values.size(), in_view(view(bytes_of(values))));
    }
    static std::string in_view(int view) { return R"(,"bufferView":)" + std::to_string(view); }

    /// `indices` below 0 means none; `mode` 4 is a list, 5 a strip, 6 a fan.
    static std::string primitive(int positions, int indices = -1, int mode = 4) {
        std::string json = R"({"attributes":{"POSITION":)" + std::to_string(positions) + "}";
        if (indices >= 0) json += R"(,"indices":)" + std::to_string(indices);
        return json + R"(,"mode":)" + std::to_string(mode) + "}";
    }
    int mesh(const std::string& primitives) {
        return meshes_.add(R"({"primitives":[)" + primitives + "]}");
    }
    int node(const std::string& properties) { return nodes_.add("{" + properties + "}"); }
    int node_of(int mesh) { return node(R"("mesh":)" + std::to_string(mesh)); }
    /// Further properties of the root, such as R"("scene":0)".
    void add_root(const std::string& property) { root_ += "," + property; }

    /// `buffer` is the buffer's "uri" with a comma, or nothing for a .glb.
    std::string json(const std::string& buffer = "") const {
        return R"({"asset":{"version":"2.0"},"buffers":[{)" + buffer + R"("byteLength":)" +
               std::to_string(binary_.size()) + R"(}],"bufferViews":[)" + views_.json +
               R"(],"accessors":[)" + accessors_.json + R"(],"meshes":[)" + meshes_.json +
               R"(],"nodes":[)" + nodes_.json + "]" + root_ + "}";
    }
    const std::string& binary() const { return binary_; }
    std::string glb() const { return make_glb(json(), binary_); }

private:
    struct List {
        std::string json;
        int count = 0;

        int add(const std::string& element) {
            if (count != 0) json += ",";
            json += element;
            return count++;
        }
    };

    List views_, accessors_, meshes_, nodes_;
    std::string binary_, root_;
};

}  // namespace packet::test
