// Ray and hit files: what is written is read back, and nothing but rays is read.
#include "npy.h"
#include "temp_dir.h"

#include <packet/error.h>

#include <doctest/doctest.h>

#include <array>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace packet::tools {
namespace {

using test::read_text;
using test::TempDir;
using test::write_text;

std::vector<Ray> some_rays(std::size_t count) {
    std::vector<Ray> rays(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto x = static_cast<float>(i);
        rays[i] = {{x, x + 0.25f, -x}, 0.5f, {1.0f, x, 1e-30f}, x + 2.0f};
    }
    return rays;
}

/// An array file of any version with a dictionary and data of the test's choice.
std::string npy(int version, const std::string& dictionary, const std::string& data) {
    std::string file = "\x93NUMPY";
    file += {static_cast<char>(version), '\0'};
    for (int byte = 0; byte < (version == 1 ? 2 : 4); ++byte) {
        file += static_cast<char>(dictionary.size() >> (8 * byte) & 0xFF);
    }
    return file + dictionary + data;
}

std::string rays_dictionary(const std::string& shape) {
    return "{'descr': '<f4', 'fortran_order': False, 'shape': " + shape + ", }\n";
}

/// The message of the error that reading the file's content gives.
std::string error_of(const std::string& content) {
    const TempDir dir;
    write_text(dir / "hostile.npy", content);
    try {
        (void)read_rays(dir / "hostile.npy");
    } catch (const Error& error) {
        CHECK(error.code() == ErrorCode::kBadFile);
        CHECK(std::string(error.what()).find("hostile.npy") != std::string::npos);
        return error.what();
    }
    return "none";
}

void check_error(const std::string& content, const std::string& expected) {
    const std::string message = error_of(content);
    CAPTURE(message);
    CHECK(message.find(expected) != std::string::npos);
}

TEST_CASE("rays that are written are read back bit for bit") {
    const TempDir dir;
    std::vector<Ray> rays = some_rays(1000);
    rays[3].tfar = std::numeric_limits<float>::infinity();
    rays[4].org.x = std::numeric_limits<float>::quiet_NaN();
    write_rays(OutputFile(dir / "rays.npy"), rays);
    const std::vector<Ray> read = read_rays(dir / "rays.npy");
    REQUIRE(read.size() == rays.size());
    CHECK(std::memcmp(read.data(), rays.data(), rays.size() * sizeof(Ray)) == 0);
}

TEST_CASE("no rays are a valid file") {
    const TempDir dir;
    write_rays(OutputFile(dir / "rays.npy"), {});
    CHECK(read_rays(dir / "rays.npy").empty());
}

TEST_CASE("a ray file is laid out as NumPy writes it") {
    const TempDir dir;
    write_rays(OutputFile(dir / "rays.npy"), some_rays(2));
    const std::string file = read_text(dir / "rays.npy");
    REQUIRE(file.size() == 128 + 2 * 32);
    CHECK(file.substr(0, 10) == std::string("\x93NUMPY\x01\x00\x76\x00", 10));
    const std::string dictionary = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 8), }";
    CHECK(file.substr(10, 118) == dictionary + std::string(117 - dictionary.size(), ' ') + "\n");
    std::array<float, 8> second_ray{};
    std::memcpy(second_ray.data(), file.data() + 128 + 32, 32);
    CHECK(second_ray == std::array{1.0f, 1.25f, -1.0f, 0.5f, 1.0f, 1.0f, 1e-30f, 3.0f});
}

TEST_CASE("a hit file holds records of six named fields") {
    const TempDir dir;
    write_hits(OutputFile(dir / "hits.npy"), std::vector<Hit>{{1.5f, 0.25f, 0.5f, 7, 8, 9}, Hit{}});
    const std::string file = read_text(dir / "hits.npy");
    REQUIRE(file.size() % 64 == 48);
    const std::string dictionary =
        "{'descr': [('t', '<f4'), ('u', '<f4'), ('v', '<f4'), ('prim_id', '<u4'), "
        "('mesh_id', '<u4'), ('instance_id', '<u4')], 'fortran_order': False, 'shape': (2,), }";
    CHECK(file.substr(10, dictionary.size()) == dictionary);
    Hit hits[2];
    std::memcpy(hits, file.data() + file.size() - sizeof(hits), sizeof(hits));
    CHECK(hits[0] == Hit{1.5f, 0.25f, 0.5f, 7, 8, 9});
    CHECK(hits[1] == Hit{});
}

TEST_CASE("an occlusion file holds a byte a ray") {
    const TempDir dir;
    write_occluded(OutputFile(dir / "any.npy"), std::vector<std::uint8_t>{1, 0, 1});
    const std::string file = read_text(dir / "any.npy");
    const std::string dictionary = "{'descr': '|u1', 'fortran_order': False, 'shape': (3,), }";
    CHECK(file.substr(10, dictionary.size()) == dictionary);
    CHECK(file.substr(file.size() - 3) == std::string("\x01\x00\x01", 3));
}

TEST_CASE("all three versions and any spelling of the dictionary are read") {
    const TempDir dir;
    const std::string data(32, '\0');
    const std::string other = "{ \"shape\":(1,8),'fortran_order' :False, 'descr':\t'<f4'}";
    for (int version = 1; version <= 3; ++version) {
        for (const std::string& dictionary : {rays_dictionary("(1, 8)"), other}) {
            write_text(dir / "rays.npy", npy(version, dictionary, data));
            CHECK(read_rays(dir / "rays.npy").size() == 1);
        }
    }
}

TEST_CASE("arrays that are not rays are refused") {
    const std::string data(64, '\0');
    const auto with = [&](const std::string& dictionary) { return npy(1, dictionary, data); };
    check_error(with("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 8), }"), "dtype");
    check_error(with("{'descr': '>f4', 'fortran_order': False, 'shape': (2, 8), }"), "dtype");
    check_error(with("{'descr': [('t', '<f4')], 'fortran_order': False, 'shape': (2, 8), }"),
                "plain element type");
    check_error(with("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 8), }"), "Fortran");
    for (const char* shape : {"()", "(16,)", "(8, 2)", "(1, 2, 8)"}) {
        check_error(with(rays_dictionary(shape)), "rays need (n, 8)");
    }
}

TEST_CASE("files that are cut off or too long are refused") {
    const std::string whole = npy(1, rays_dictionary("(2, 8)"), std::string(64, '\0'));
    for (std::size_t size = 0; size < whole.size(); ++size) {
        CHECK(error_of(whole.substr(0, size)) != "none");
    }
    check_error(whole + "x", "too long");
}

TEST_CASE("sizes that overflow are refused before memory is taken") {
    const std::string data(32, '\0');
    // 2^59 + 1 rays have 2^64 + 32 bytes, which in 64 bits are 32.
    check_error(npy(1, rays_dictionary("(576460752303423489, 8)"), data), "truncated");
    check_error(npy(1, rays_dictionary("(18446744073709551615, 8)"), data), "truncated");
    check_error(npy(1, rays_dictionary("(18446744073709551616, 8)"), data), "number");
    check_error(npy(1, rays_dictionary("(-1, 8)"), data), "number");
    check_error(npy(2, rays_dictionary("(1, 8)"), data).replace(8, 4, "\xFF\xFF\xFF\xFF"),
                "header has 4294967295 bytes");
}

TEST_CASE("malformed headers are refused") {
    const std::string data(32, '\0');
    check_error("", "truncated");
    check_error(std::string(256, 'x'), "not an NPY file");
    check_error(npy(9, rays_dictionary("(1, 8)"), data), "version 9.0");
    for (const char* dictionary :
         {"", "{", "{}", "{'descr': '<f4', 'fortran_order': False}",
          "{'descr': '<f4, 'fortran_order': False, 'shape': (1, 8)}",
          "{'descr' '<f4', 'fortran_order': False, 'shape': (1, 8)}",
          "{'descr': '<f4', 'fortran_order': 0, 'shape': (1, 8)}",
          "{'descr': '<f4', 'fortran_order': False, 'shape': (1 8)}",
          "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 8), 'x': 1}",
          "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 8), 'shape': (1, 8)}",
          "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 8)} x"}) {
        CAPTURE(std::string(dictionary));
        check_error(npy(1, dictionary, data), "bad NPY header");
    }
}

TEST_CASE("a file that cannot be read or written says so") {
    const TempDir dir;
    const auto io_error = [](const Error& error) { return error.code() == ErrorCode::kIo; };
    try {
        (void)read_rays(dir / "missing.npy");
        FAIL("read a missing file");
    } catch (const Error& error) {
        CHECK(io_error(error));
    }
    CHECK_THROWS_AS((void)read_rays(dir.path()), Error);
    CHECK_THROWS_AS(write_rays(OutputFile(dir / "no" / "rays.npy"), {}), Error);
    CHECK_THROWS_AS(write_rays(OutputFile("/dev/full"), {}), Error);
}

TEST_CASE("a file that is not committed leaves nothing and harms nothing") {
    const TempDir dir;
    write_text(dir / "old.npy", "old");
    {
        OutputFile file(dir / "old.npy");
        file.write("new");
        CHECK(read_text(dir / "old.npy") == "old");
    }
    CHECK(read_text(dir / "old.npy") == "old");
    CHECK(dir.file_count() == 1);
}

TEST_CASE("a link to a file stays a link when the file is written") {
    const TempDir dir;
    write_text(dir / "target", "old");
    std::filesystem::create_symlink(dir / "target", dir / "link");
    OutputFile file(dir / "link");
    file.write("new");
    file.commit();
    CHECK(std::filesystem::is_symlink(dir / "link"));
    CHECK(read_text(dir / "target") == "new");
}

}  // namespace
}  // namespace packet::tools
