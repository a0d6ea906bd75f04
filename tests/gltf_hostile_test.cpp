// Files that are cut off, malformed or refer outside of themselves. Each has to end in an Error
// that names the file and the object.
#include "gltf_builder.h"
#include "scene/gltf_load.h"
#include "temp_dir.h"

#include <packet/error.h>
#include <packet/gltf.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <random>
#include <string>

namespace packet::test {
namespace {

/// The error that loading ends in; without a value it succeeded. Other exceptions pass.
std::optional<Error> error_of(const std::string& bytes, const char* name = "hostile.gltf") {
    try {
        (void)load_gltf(as_bytes(bytes), name);
    } catch (const Error& error) {
        return error;
    }
    return std::nullopt;
}

void check_error(const std::string& bytes, const std::string& words,
                 ErrorCode code = ErrorCode::kBadFile) {
    const std::optional<Error> error = error_of(bytes);
    REQUIRE_MESSAGE(error.has_value(), "loaded; should say: ", words);
    CHECK(error->code() == code);
    const std::string text = error->what();
    CHECK_MESSAGE(text.starts_with("hostile.gltf: "), text);
    CHECK_MESSAGE(text.find(words) != text.npos, text, " does not say: ", words);
}

/// Two nodes, the second a child of the first; an indexed square; a sparse accessor.
GltfBuilder make_victim() {
    GltfBuilder builder;
    const int square = builder.positions({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    const int indices = builder.indices<std::uint16_t>({0, 1, 2, 2, 3, 0});
    const int sparse_indices = builder.view(bytes_of<std::uint8_t>({1, 2}));
    const int sparse_values = builder.view(bytes_of<float>({1, 0, 0, 0, 1, 0}));
    const int sparse = builder.accessor(GltfBuilder::kFloat, "VEC3", 3,
                                        R"(,"sparse":{"count":2,"indices":{"bufferView":)" +
                                            std::to_string(sparse_indices) +
                                            R"(,"componentType":5121},"values":{"bufferView":)" +
                                            std::to_string(sparse_values) + "}}");
    const int mesh = builder.mesh(GltfBuilder::primitive(square, indices) + "," +
                                  GltfBuilder::primitive(sparse, -1, 5));
    builder.node(R"("children":[1],"translation":[1,2,3])");
    builder.node_of(mesh);
    builder.add_root(R"("scene":0,"scenes":[{"nodes":[0]}])");
    return builder;
}

/// The victim with something in its JSON replaced.
std::string altered(std::string_view from, std::string_view to) {
    const GltfBuilder victim = make_victim();
    return make_glb(replaced(victim.json(), from, to), victim.binary());
}

}  // namespace

TEST_CASE("the victim of these tests is sound") {
    CHECK(load_gltf(as_bytes(make_victim().glb()), "").scene.triangle_count() == 3);
}

TEST_CASE("indices that point at nothing are named") {
    check_error(altered(R"("scene":0)", R"("scene":7)"), "scene 7");
    check_error(altered(R"("nodes":[0])", R"("nodes":[2])"), "scene 0: refers to node 2");
    check_error(altered(R"("children":[1])", R"("children":[9])"), "node 0: refers to node 9");
    check_error(altered(R"("mesh":0)", R"("mesh":1)"), "node 1: refers to mesh 1");
    check_error(altered(R"("POSITION":0)", R"("POSITION":3)"), "accessor 3");
    check_error(altered(R"("indices":1)", R"("indices":3)"),
                "mesh 0: its indices are in accessor 3");
    check_error(altered(R"("bufferView":0)", R"("bufferView":4)"),
                "accessor 0: is in buffer view 4");
    check_error(altered(R"("buffer":0)", R"("buffer":1)"), "buffer view 0: is in buffer 1");
    check_error(altered(R"("indices":{"bufferView":2)", R"("indices":{"bufferView":4)"),
                "accessor 2, sparse indices: is in buffer view 4");
    check_error(altered(R"("values":{"bufferView":3)", R"("values":{"bufferView":4)"),
                "accessor 2, sparse values: is in buffer view 4");
}

TEST_CASE("a vertex index out of range is named") {
    GltfBuilder builder;
    const int corners = builder.positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    const int indices = builder.indices<std::uint32_t>({0, 1, 2, 0, 1, 0xFFFFFFFF});
    builder.node_of(builder.mesh(GltfBuilder::primitive(corners, indices)));
    check_error(builder.glb(), "mesh 0, primitive 0: index 5 of accessor 1 is 4294967295");
}

TEST_CASE("a sparse index out of range is named") {
    GltfBuilder victim = make_victim();
    const std::string glb = victim.glb();
    check_error(replaced(glb, std::string("\1\2\0\0\0\0\x80\x3F", 8),
                         std::string("\1\3\0\0\0\0\x80\x3F", 8)),
                "accessor 2, sparse indices: the one at 1 is 3");
    check_error(altered(R"("sparse":{"count":2)", R"("sparse":{"count":4)"),
                "accessor 2, sparse indices: are 4 for 3 elements");
}

TEST_CASE("values of the wrong type or range are named, not taken as absent") {
    const char* values[] = {"-1",   "1.0", R"("1")", "4294967296", "null",
                            "true", "[]",  "{}",     "1e99"};
    for (const std::string value : values) {
        CAPTURE(value);
        check_error(altered(R"("indices":1)", R"("indices":)" + value),
                    "meshes[0].primitives[0].indices: must be an integer from 0 to 2147483647");
        check_error(altered(R"("mesh":0)", R"("mesh":)" + value), "nodes[1].mesh: must be");
        check_error(altered(R"("count":4)", R"("count":)" + (value == "4294967296" ? "{}" : value)),
                    "accessors[0].count: must be");
    }
    check_error(altered(R"("byteOffset":0)", R"("byteOffset":-4)"),
                "bufferViews[0].byteOffset: must");
    check_error(altered("[1,2,3]", "[1,2]"), "nodes[0].translation: must have 3 elements");
    check_error(altered("[1,2,3]", R"([1,2,"3"])"), "nodes[0].translation[2]: must be a number");
    check_error(altered("[1,2,3]", "7"), "nodes[0].translation: must be an array");
    check_error(altered(R"("count":4,)", ""), "accessors[0].count: is missing");
    check_error(altered(R"("attributes":)", R"("attribute":)"),
                "meshes[0].primitives[0].attributes: is missing");
    check_error(altered(R"("count":4,)", R"("count":4,"count":4,)"),
                "accessors[0].count: occurs twice");
    check_error(altered(R"("mode":4)", R"("mode":7)"),
                "mesh 0, primitive 0: has the unknown mode 7");
    check_error(altered(R"("VEC3")", R"("VEC2")"), "accessor 0: holds positions, but is no VEC3");
    check_error(altered(R"("VEC3")", R"("VEC9")"), "accessor 0: Unsupported `type`");
    check_error(altered(R"("SCALAR")", R"("VEC2")"), "accessor 1: holds indices, but is no SCALAR");
    check_error(altered("5126", "5125"), "accessor 0: holds positions of component type 5125");
    check_error(altered("5123", "5122"), "accessor 1: component type 5122");
    check_error(altered("5126", "77"), "accessor 0: ");
    check_error(altered(R"("2.0")", R"("1.0")"), "asset.version is not 2.x");
}

TEST_CASE("ranges beyond their view or buffer are named") {
    check_error(
        altered(R"("count":4)", R"("count":5)"),
        "accessor 0: needs 5 elements of 12 bytes, 12 apart, from byte 0 on of buffer view 0, "
        "which has 48");
    check_error(altered(R"("byteLength":48)", R"("byteLength":480)"),
                "buffer view 0: needs 480 bytes");
    check_error(altered(R"("byteOffset":48)", R"("byteOffset":4800)"),
                "buffer view 1: needs 12 bytes");
    check_error(altered(R"("bufferView":0)", R"("bufferView":0,"byteOffset":1)"),
                "accessor 0: needs");
    check_error(altered(R"("byteLength":48)", R"("byteLength":48,"byteStride":8)"),
                "accessor 0: has elements of 12 bytes, but a stride of 8");
    check_error(altered(R"("byteLength":48)", R"("byteLength":48,"byteStride":7)"),
                "buffer view 0: ");
    check_error(altered(R"("byteLength":88)", R"("byteLength":1088)"),
                "buffer 0: should have 1088");
    // Products and sums of these wrap around in 64 bits.
    check_error(altered(R"("count":4)", R"("count":18446744073709551615)"), "accessor 0: needs");
    check_error(altered(R"("count":4)", R"("count":1537228672809129302)"), "accessor 0: needs");
    check_error(altered(R"("byteOffset":0)", R"("byteOffset":18446744073709551608)"),
                "buffer view 0");
    check_error(altered(R"("bufferView":0)", R"("bufferView":0,"byteOffset":18446744073709551612)"),
                "accessor 0: needs");
}

TEST_CASE("nodes that are no trees are named") {
    check_error(altered(R"("mesh":0)", R"("mesh":0,"children":[0])"), "node 0: has a cycle");
    check_error(altered(R"("children":[1])", R"("children":[0])"), "node 0: has a cycle");
    check_error(altered(R"("children":[1])", R"("children":[1,1])"),
                "node 1: is a child of node 0");
    check_error(altered(R"("nodes":[0]})", R"("nodes":[0,0]})"), "scene 0: node 0 is a root twice");
    check_error(altered(R"("nodes":[0]})", R"("nodes":[0,1]})"), "scene 0: node 1 is a root, but");
    check_error(altered(R"("children":[1],)", R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,2],)"),
                "node 0: the bottom row");
}

TEST_CASE("a transform that is not finite is named") {
    check_error(altered("[1,2,3]", "[1e39,2,3]"), "node 1: its transform overflows a float");
    check_error(altered(R"("mesh":0)", R"("mesh":0,"scale":[1e300,1,1],"children":[2]},)"
                                       R"({"scale":[1e300,1,1])"),
                "node 1: its transform");
    check_error(altered("[1,2,3]", "[1e999,2,3]"), "is not valid JSON");
}

TEST_CASE("zeros that are stored nowhere are bounded before they are allocated") {
    check_error(altered(R"(,"count":3,"sparse")", R"(,"count":4000000000,"sparse")"),
                "accessor 2, elements: 4000000000 of 12 bytes", ErrorCode::kTooLarge);
}

TEST_CASE("triangles that many primitives repeat are bounded") {
    GltfBuilder builder;
    const int corners = builder.positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    const int view = builder.view(std::string(500000, '\0'));
    const int indices =
        builder.accessor(GltfBuilder::kUnsignedByte, "SCALAR", 500000, GltfBuilder::in_view(view));
    std::string primitives = GltfBuilder::primitive(corners, indices, 5);
    for (int i = 0; i < 10; ++i) primitives += "," + primitives;
    builder.node_of(builder.mesh(primitives));
    check_error(builder.glb(), "more than a file of this size may fill", ErrorCode::kTooLarge);
}

TEST_CASE("a million empty nodes are more than their bytes may hold") {
    std::string nodes = "{}";
    while (nodes.size() < 3000000) nodes += "," + nodes;
    check_error(R"({"asset":{"version":"2.0"},"nodes":[)" + nodes + "]}",
                "is one object more than a file of this size may hold", ErrorCode::kTooLarge);
}

TEST_CASE("required extensions that hide geometry are refused by name") {
    const auto with = [](const std::string& property) {
        GltfBuilder victim = make_victim();
        victim.add_root(property);
        return victim.glb();
    };
    check_error(with(R"("extensionsRequired":["KHR_draco_mesh_compression"])"),
                "KHR_draco_mesh_compression", ErrorCode::kUnsupported);
    check_error(with(R"("extensionsRequired":["x","EXT_meshopt_compression"])"),
                "EXT_meshopt_compression", ErrorCode::kUnsupported);
    CHECK(!error_of(with(R"("extensionsRequired":["KHR_mesh_quantization"])")));

    // Not required, so a fallback should be there; but the accessor has neither view nor sparse
    // values.
    GltfBuilder packed;
    const int nothing = packed.accessor(GltfBuilder::kFloat, "VEC3", 3, "");
    packed.node_of(packed.mesh(R"({"extensions":{"KHR_draco_mesh_compression":{"bufferView":0}},)"
                               R"("attributes":{"POSITION":)" +
                               std::to_string(nothing) + "}}"));
    check_error(packed.json(R"("uri":"data:;base64,",)"),
                "mesh 0, primitive 0: is compressed by KHR_draco", ErrorCode::kUnsupported);
}

TEST_CASE("a buffer's URI cannot lead out of the file's folder") {
    const TempDir folder;
    const GltfBuilder victim = make_victim();
    const std::filesystem::path inner = folder / "inner";
    std::filesystem::create_directory(inner);
    const std::string outside = (folder / "secret.bin").string();
    write_text(outside, victim.binary());
    for (const std::string& uri :
         {std::string("../secret.bin"), std::string("x/../../secret.bin"),
          std::string("%2e%2e/secret.bin"), std::string("%2E%2E%2Fsecret.bin"), outside,
          "file://" + outside, std::string("http://host/a.bin"), std::string(""), std::string(".."),
          std::string("a%00.bin")}) {
        CAPTURE(uri);
        const std::string json = victim.json(R"("uri":")" + uri + R"(",)");
        const auto path = inner / "scene.gltf";
        try {
            (void)load_gltf(as_bytes(json), path);
            FAIL("it loaded");
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::kBadFile);
            CHECK(std::string(error.what()).starts_with(path.string() + ": buffer 0: its URI"));
        }
    }
}

TEST_CASE("buffers that are missing, short, or not base64 are named") {
    const GltfBuilder victim = make_victim();
    const auto with_uri = [&](const std::string& uri) {
        return victim.json(R"("uri":")" + uri + R"(",)");
    };
    const std::string data = "data:application/octet-stream;base64,";
    check_error(with_uri("no/such/file.bin"), "buffer 0: cannot read", ErrorCode::kIo);
    check_error(with_uri("."), "buffer 0: cannot read", ErrorCode::kIo);
    check_error(with_uri(data + "AAAA"), "buffer 0: should have 88 bytes, but has 3");
    check_error(with_uri(data + "AAAAA"), "buffer 0: its data URI is cut off");
    check_error(with_uri(data + "A?AA"), "buffer 0: its data URI has a character");
    check_error(with_uri("data:text/plain,AAAA"), "buffer 0: its data URI is not in base64");
    check_error(victim.json(), "buffer 0: has no URI");
    check_error(
        make_glb(replaced(victim.json(), R"("buffers":[)", R"("buffers":[{"byteLength":1},)"),
                 victim.binary()),
        "buffer 1: has no URI and is not the binary chunk");
}

TEST_CASE("a path that is no file is an input error") {
    const TempDir folder;
    for (const auto& path : {folder.path(), folder / "missing.glb"}) {
        try {
            (void)load_gltf(path);
            FAIL("it loaded");
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::kIo);
            CHECK(std::string(error.what()).find(path.string()) != std::string::npos);
        }
    }
}

TEST_CASE("what is not glTF at all is refused") {
    for (const char* text : {"", "g", "glTF", "{", "[]", "7", "null", "{}", R"({"asset":{}})",
                             R"({"asset":{"version":"2.0"}} x)", "\xFF\xFE"}) {
        CAPTURE(text);
        check_error(text, "");
    }
    const std::string glb = make_victim().glb();
    check_error(replaced(glb, "JSON", "JSOM"), "its first chunk is not JSON");
    check_error(replaced(glb, std::string("glTF\2", 5), std::string("glTF\1", 5)), "binary glTF 1");
    const std::optional<Error> error = error_of(replaced(glb, "glTF", "glTf"), "wrong.glb");
    REQUIRE(error.has_value());
    CHECK(std::string(error->what()).find("does not begin with 'glTF'") != std::string::npos);
}

TEST_CASE("a .glb cut off at any byte is an error") {
    const std::string glb = make_victim().glb();
    for (std::size_t size = 0; size < glb.size(); ++size) {
        CAPTURE(size);
        CHECK(error_of(glb.substr(0, size)).has_value());
    }
    // With the header's length cut as well, what is left looks whole.
    for (std::size_t size = 12; size < glb.size(); ++size) {
        CAPTURE(size);
        std::string cut = glb.substr(0, size);
        const std::string length = bytes_of({static_cast<std::uint32_t>(size)});
        std::copy(length.begin(), length.end(), cut.begin() + 8);
        CHECK(error_of(cut).has_value());
    }
}

TEST_CASE("random changes of bytes end in a scene or an Error") {
    const unsigned seed = 20240229;
    CAPTURE(seed);
    std::mt19937 random(seed);
    const GltfBuilder victim = make_victim();
    const std::string text = victim.json(R"("uri":"data:application/octet-stream;base64,)" +
                                         base64(victim.binary()) + R"(",)");
    const std::string digits = R"(0123456789-.e"[]{},:)";
    int error_count = 0;
    constexpr int kRounds = 10000;
    for (int round = 0; round < kRounds; ++round) {
        CAPTURE(round);
        std::string mutant = round % 2 == 0 ? victim.glb() : text;
        for (std::size_t i = 0; i <= random() % 4; ++i) {
            const bool is_text = random() % 2 != 0;
            mutant[random() % mutant.size()] =
                is_text ? digits[random() % digits.size()] : static_cast<char>(random());
        }
        error_count += error_of(mutant).has_value();
    }
    CHECK(error_count > kRounds / 4);
    CHECK(error_count < kRounds);
}

}  // namespace packet::test
