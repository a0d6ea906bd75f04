// What a glTF file's scene is. tests/gltf_hostile_test.cpp has what is none.
#include "gltf_builder.h"
#include "scene/gltf_load.h"
#include "temp_dir.h"

#include <packet/error.h>
#include <packet/gltf.h>

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

namespace packet::test {
namespace {

using Triangles = std::vector<glm::uvec3>;
using Points = std::vector<glm::vec3>;

GltfScene load(const std::string& text) { return load_gltf(as_bytes(text), "test.gltf"); }

/// The only mesh of a builder's scene, after a node for it is added.
TriangleMesh load_mesh(GltfBuilder& builder, const std::string& primitives) {
    builder.node_of(builder.mesh(primitives));
    const GltfScene loaded = load(builder.glb());
    REQUIRE(loaded.scene.meshes().size() == 1);
    REQUIRE(loaded.scene.instances().size() == 1);
    return loaded.scene.meshes()[0];
}

int add_square(GltfBuilder& builder) {
    return builder.positions({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
}

/// A builder with one mesh, a triangle, and no nodes yet.
GltfBuilder make_triangle() {
    GltfBuilder builder;
    builder.mesh(builder.primitive(builder.positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})));
    return builder;
}

}  // namespace

TEST_CASE("indices of 8, 16 and 32 bits and none at all give the same triangles") {
    const Triangles expected = {{0, 1, 2}, {2, 3, 0}};
    GltfBuilder bits8, bits16, bits32, none;
    const auto square8 = add_square(bits8), square16 = add_square(bits16);
    const auto square32 = add_square(bits32);
    const int indices8 = bits8.indices<std::uint8_t>({0, 1, 2, 2, 3, 0});
    const int indices16 = bits16.indices<std::uint16_t>({0, 1, 2, 2, 3, 0});
    const int indices32 = bits32.indices<std::uint32_t>({0, 1, 2, 2, 3, 0});
    CHECK(load_mesh(bits8, GltfBuilder::primitive(square8, indices8)).triangles == expected);
    CHECK(load_mesh(bits16, GltfBuilder::primitive(square16, indices16)).triangles == expected);
    CHECK(load_mesh(bits32, GltfBuilder::primitive(square32, indices32)).triangles == expected);

    const int corners =
        none.positions({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 0}});
    const TriangleMesh mesh = load_mesh(none, GltfBuilder::primitive(corners));
    CHECK(mesh.triangles == Triangles{{0, 1, 2}, {3, 4, 5}});
    CHECK(mesh.positions[4] == glm::vec3(0, 1, 0));
}

TEST_CASE("a strip alternates its winding") {
    GltfBuilder builder;
    const int positions =
        builder.positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 2, 0}});
    const TriangleMesh mesh = load_mesh(builder, GltfBuilder::primitive(positions, -1, 5));
    CHECK(mesh.triangles == Triangles{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}});
    for (const glm::uvec3& t : mesh.triangles) {
        const glm::vec3 a = mesh.positions[t.y] - mesh.positions[t.x];
        const glm::vec3 b = mesh.positions[t.z] - mesh.positions[t.x];
        CHECK(a.x * b.y - a.y * b.x > 0.0f);
    }
}

TEST_CASE("an indexed strip takes its vertices in the order of the indices") {
    GltfBuilder builder;
    const int square = add_square(builder);
    const int indices = builder.indices<std::uint16_t>({3, 0, 2, 1});
    CHECK(load_mesh(builder, GltfBuilder::primitive(square, indices, 5)).triangles ==
          Triangles{{3, 0, 2}, {0, 1, 2}});
}

TEST_CASE("a fan's triangles share its first vertex") {
    GltfBuilder builder;
    const int square = add_square(builder);
    CHECK(load_mesh(builder, GltfBuilder::primitive(square, -1, 6)).triangles ==
          Triangles{{1, 2, 0}, {2, 3, 0}});
}

TEST_CASE("vertices beyond the last whole triangle are ignored") {
    GltfBuilder builder;
    const int square = add_square(builder);
    const int pair = builder.positions({{0, 0, 0}, {1, 0, 0}});
    const std::string strip_of_two = GltfBuilder::primitive(pair, -1, 5);
    CHECK(load_mesh(builder, GltfBuilder::primitive(square) + "," + strip_of_two).triangles ==
          Triangles{{0, 1, 2}});
}

TEST_CASE("primitives are concatenated in order and shared vertices stored once") {
    GltfBuilder builder;
    const int square = add_square(builder);
    const int other = builder.positions({{5, 0, 0}, {6, 0, 0}, {5, 1, 0}});
    const int first = builder.indices<std::uint8_t>({0, 1, 2});
    const int second = builder.indices<std::uint8_t>({2, 3, 0});
    const TriangleMesh mesh = load_mesh(builder, GltfBuilder::primitive(square, first) + "," +
                                                     GltfBuilder::primitive(other) + "," +
                                                     GltfBuilder::primitive(square, second));
    CHECK(mesh.triangles == Triangles{{0, 1, 2}, {4, 5, 6}, {2, 3, 0}});
    CHECK(mesh.positions.size() == 7);
    CHECK(mesh.positions[4] == glm::vec3(5, 0, 0));
}

TEST_CASE("points, lines and primitives without positions are counted once for each instance") {
    GltfBuilder builder;
    const int square = add_square(builder);
    std::string primitives;
    for (const int mode : {0, 1, 2, 3, 4}) {
        primitives += GltfBuilder::primitive(square, -1, mode) + ",";
    }
    const int mixed = builder.mesh(primitives + R"({"attributes":{}})");
    const int lines = builder.mesh(GltfBuilder::primitive(square, -1, 1));
    for (const int mesh : {mixed, mixed, lines}) builder.node_of(mesh);
    const GltfScene loaded = load(builder.glb());
    CHECK(loaded.skipped_primitives == 5 + 5 + 1);
    CHECK(loaded.scene.meshes().size() == 1);
    CHECK(loaded.scene.instances().size() == 2);
    CHECK(loaded.scene.triangle_count() == 2);
}

TEST_CASE("interleaved attributes are read at their stride and offset") {
    GltfBuilder builder;
    const int view = builder.view(bytes_of<float>({-1, -1, 0, 0, 0, -1,  //
                                                   -1, -1, 1, 0, 0, -1,  //
                                                   -1, -1, 0, 1, 0}),
                                  24);
    const int positions = builder.accessor(GltfBuilder::kFloat, "VEC3", 3,
                                           GltfBuilder::in_view(view) + R"(,"byteOffset":8)");
    CHECK(load_mesh(builder, GltfBuilder::primitive(positions)).positions ==
          Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
}

TEST_CASE("a sparse accessor replaces elements of its view, or of zeros if it has none") {
    for (const bool has_view : {false, true}) {
        GltfBuilder builder;
        const int base = builder.view(bytes_of<float>({1, 1, 1, 2, 2, 2, 3, 3, 3}));
        const int indices = builder.view(bytes_of<std::uint16_t>({0xFFFF, 0, 2}));
        const int values = builder.view(bytes_of<float>({7, 8, 9, 4, 5, 6}));
        const std::string sparse = R"(,"sparse":{"count":2,"indices":{"bufferView":)" +
                                   std::to_string(indices) +
                                   R"(,"byteOffset":2,"componentType":5123},)"
                                   R"("values":{"bufferView":)" +
                                   std::to_string(values) + "}}";
        const int positions = builder.accessor(
            GltfBuilder::kFloat, "VEC3", 3, (has_view ? GltfBuilder::in_view(base) : "") + sparse);
        const glm::vec3 kept(has_view ? 2.0f : 0.0f);
        CHECK(load_mesh(builder, GltfBuilder::primitive(positions)).positions ==
              Points{{7, 8, 9}, kept, {4, 5, 6}});
    }
}

TEST_CASE("quantized positions are integers, or fractions of the largest if normalized") {
    const auto first_position = [](int type, const std::string& bytes, bool is_normalized) {
        GltfBuilder builder;
        const int view = builder.view(bytes, static_cast<int>((bytes.size() + 3) / 4 * 4));
        const int positions = builder.accessor(
            type, "VEC3", 1,
            GltfBuilder::in_view(view) + (is_normalized ? R"(,"normalized":true)" : ""));
        const int indices = builder.indices<std::uint8_t>({0, 0, 0});
        return load_mesh(builder, GltfBuilder::primitive(positions, indices)).positions.at(0);
    };
    const std::string i8 = bytes_of<std::int8_t>({-128, 127, 0});
    const std::string u8 = bytes_of<std::uint8_t>({255, 51, 0});
    const std::string i16 = bytes_of<std::int16_t>({-32768, 32767, 1});
    const std::string u16 = bytes_of<std::uint16_t>({65535, 13107, 0});
    CHECK(first_position(GltfBuilder::kByte, i8, false) == glm::vec3(-128, 127, 0));
    CHECK(first_position(GltfBuilder::kByte, i8, true) == glm::vec3(-1, 1, 0));
    CHECK(first_position(GltfBuilder::kUnsignedByte, u8, false) == glm::vec3(255, 51, 0));
    CHECK(first_position(GltfBuilder::kUnsignedByte, u8, true) == glm::vec3(1, 0.2f, 0));
    CHECK(first_position(GltfBuilder::kShort, i16, false) == glm::vec3(-32768, 32767, 1));
    CHECK(first_position(GltfBuilder::kShort, i16, true) == glm::vec3(-1, 1, 1 / 32767.0f));
    CHECK(first_position(GltfBuilder::kUnsignedShort, u16, false) == glm::vec3(65535, 13107, 0));
    CHECK(first_position(GltfBuilder::kUnsignedShort, u16, true) == glm::vec3(1, 0.2f, 0));
}

TEST_CASE("a node scales, then rotates, then translates, then follows its parent") {
    GltfBuilder builder = make_triangle();
    // A quarter turn about z: x goes to y.
    builder.node(R"("mesh":0,"scale":[2,3,4],"translation":[10,20,30],)"
                 R"("rotation":[0,0,0.7071067811865476,0.7071067811865476])");
    builder.node(R"("children":[0],"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 100,0,0,1])");
    const GltfScene loaded = load(builder.glb());
    REQUIRE(loaded.scene.instances().size() == 1);
    const glm::mat4x3& m = loaded.scene.instances()[0].world_from_object;
    const glm::mat4x3 expected(0, 2, 0, 3, 0, 0, 0, 0, 4, 90, 20, 30);
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 3; ++row) {
            CHECK(m[column][row] == doctest::Approx(expected[column][row]).epsilon(1e-6));
        }
    }
}

TEST_CASE("transforms are multiplied in double") {
    GltfBuilder builder = make_triangle();
    builder.node(R"("mesh":0,"translation":[-1000000000,0,0.25])");
    builder.node(R"("children":[0],"translation":[1000000000.25,0,0])");
    const GltfScene loaded = load(builder.glb());
    REQUIRE(loaded.scene.instances().size() == 1);
    CHECK(loaded.scene.instances()[0].world_from_object[3] == glm::vec3(0.25f, 0, 0.25f));
}

TEST_CASE("a mirroring node keeps its mirror") {
    GltfBuilder builder = make_triangle();
    builder.node(R"("mesh":0,"scale":[1,-1,1])");
    const GltfScene loaded = load(builder.glb());
    CHECK(loaded.scene.flatten().positions[2] == glm::vec3(0, -1, 0));
}

TEST_CASE("instances come depth first and meshes in the file's order") {
    GltfBuilder builder;
    for (int i = 0; i < 4; ++i) {
        const float x = static_cast<float>(i);
        builder.mesh(GltfBuilder::primitive(builder.positions({{x, 0, 0}, {x, 1, 0}, {x, 0, 1}})));
    }
    builder.node(R"("mesh":3,"children":[2,3])");
    builder.node(R"("mesh":0)");  // not in the scene
    builder.node(R"("mesh":2,"children":[4])");
    builder.node(R"("mesh":3,"translation":[0,0,5])");
    builder.node(R"("mesh":1)");
    builder.node(R"("mesh":1,"translation":[0,0,7])");
    builder.add_root(R"("scene":1,"scenes":[{"nodes":[1]},{"nodes":[5,0]}])");
    const GltfScene loaded = load(builder.glb());
    Points first_vertices;
    for (const TriangleMesh& mesh : loaded.scene.meshes()) {
        first_vertices.push_back(mesh.positions[0]);
    }
    CHECK(first_vertices == Points{{1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
    std::vector<std::uint32_t> mesh_ids;
    for (const Instance& instance : loaded.scene.instances()) mesh_ids.push_back(instance.mesh_id);
    CHECK(mesh_ids == std::vector<std::uint32_t>{0, 2, 1, 0, 2});
    CHECK(loaded.scene.instances()[0].world_from_object[3] == glm::vec3(0, 0, 7));
    CHECK(loaded.scene.instances()[4].world_from_object[3] == glm::vec3(0, 0, 5));
}

TEST_CASE("without a default scene every root node counts") {
    GltfBuilder builder = make_triangle();
    builder.node(R"("mesh":0,"children":[1])");
    builder.node_of(0);
    builder.node_of(0);
    builder.add_root(R"("scenes":[{"nodes":[0]}])");
    CHECK(load(builder.glb()).scene.instances().size() == 3);
}

TEST_CASE("a node that is scaled to nothing is skipped and counted") {
    GltfBuilder builder = make_triangle();
    builder.node(R"("mesh":0,"scale":[0,0,0])");
    builder.node(R"("mesh":0,"scale":[1,1,0])");
    builder.node_of(0);
    const GltfScene loaded = load(builder.glb());
    CHECK(loaded.skipped_instances == 2);
    CHECK(loaded.scene.instances().size() == 1);
}

TEST_CASE("a buffer may be a chunk, a data URI or a file, and may be longer than needed") {
    GltfBuilder builder = make_triangle();
    builder.node_of(0);
    const TempDir folder;
    std::filesystem::create_directory(folder / "sub");
    write_text(folder / "a b.bin", builder.binary() + "tail");
    write_text(folder / "sub/c.bin", builder.binary());
    const std::string data =
        R"("uri":"data:application/octet-stream;base64,)" + base64(builder.binary()) + R"(",)";
    write_text(folder / "chunk.glb", builder.glb());
    write_text(folder / "data.gltf", builder.json(data));
    write_text(folder / "file.gltf", builder.json(R"("uri":"a%20b.bin",)"));
    write_text(folder / "folder.gltf", builder.json(R"("uri":"sub/../sub/c.bin",)"));
    write_text(folder / "data.glb", make_glb(builder.json(data), "unused"));
    for (const char* name : {"chunk.glb", "data.gltf", "file.gltf", "folder.gltf", "data.glb"}) {
        CAPTURE(name);
        const GltfScene loaded = load_gltf(folder / name);
        REQUIRE(loaded.scene.meshes().size() == 1);
        CHECK(loaded.scene.meshes()[0].positions == Points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    }
}

TEST_CASE("what is not geometry is not looked at") {
    GltfBuilder builder = make_triangle();
    builder.node_of(0);
    builder.add_root(R"("images":[{"uri":"missing.png"},{"uri":"data:image/png;base64,!"},)"
                     R"({"bufferView":99}],"materials":[1,[2]],"animations":"none")");
    const std::string deep(200000, '[');
    builder.add_root(R"("extras":)" + deep + std::string(deep.size(), ']'));
    CHECK(load(builder.glb()).scene.triangle_count() == 1);
}

TEST_CASE("an infinite vertex is loaded, for the build to skip its triangles") {
    GltfBuilder builder;
    const float infinity = std::numeric_limits<float>::infinity();
    const int positions = builder.positions({{0, 0, 0}, {infinity, 0, 0}, {0, 1, 0}});
    CHECK(std::isinf(load_mesh(builder, GltfBuilder::primitive(positions)).positions[1].x));
}

TEST_CASE("nodes may be nested deeper than the stack could follow") {
    GltfBuilder builder = make_triangle();
    constexpr int kDepth = 200000;
    for (int i = 0; i < kDepth; ++i) {
        builder.node(R"("translation":[0,0,1],"children":[)" + std::to_string(i + 1) + "]");
    }
    builder.node_of(0);
    const GltfScene loaded = load(builder.glb());
    REQUIRE(loaded.scene.instances().size() == 1);
    CHECK(loaded.scene.instances()[0].world_from_object[3].z == kDepth);
}

TEST_CASE("the models of assimp load or throw an Error") {
    const std::filesystem::path models = "/usr/share/assimp/models/glTF2";
    if (!std::filesystem::exists(models)) {
        MESSAGE("skipped: package assimp-testmodels is not installed");
        return;
    }
    int loaded_count = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(models)) {
        const std::string extension = entry.path().extension().string();
        if (extension != ".gltf" && extension != ".glb") continue;
        CAPTURE(entry.path());
        try {
            (void)load_gltf(entry.path());
            ++loaded_count;
        } catch (const Error& error) {
            CHECK(std::string(error.what()).find(entry.path().string()) == 0);
        }
    }
    CHECK(loaded_count >= 30);
    const GltfScene engine = load_gltf(models / "2CylinderEngine-glTF-Binary/2CylinderEngine.glb");
    CHECK(engine.scene.triangle_count() == 121496);
}

}  // namespace packet::test
