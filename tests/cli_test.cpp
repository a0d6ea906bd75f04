// The program as others run it: what it reads and writes, prints and returns.
// PACKET_CLI_PATH is the path of the program.
#include "npy.h"
#include "temp_dir.h"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#define STB_IMAGE_STATIC  // other libraries of the test program may bring a copy of their own
#define STB_IMAGE_IMPLEMENTATION
#include <stb/stb_image.h>

#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace packet::tools {
namespace {

using nlohmann::json;
using test::read_text;
using test::TempDir;
using test::write_text;

struct Outcome {
    int exit_code;
    std::string out, err;
};

/// A folder to run the program in. Arguments and redirections are as a shell takes them.
class Program {
public:
    Outcome run(const std::string& arguments, const std::string& environment = "") const {
        const std::string command = "cd '" + dir_.path().string() + "' && " + environment + " '" +
                                    PACKET_CLI_PATH + "' >out 2>err " + arguments;
        const int status = std::system(command.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(dir_ / "out"),
                read_text(dir_ / "err")};
    }
    /// What a run that succeeds prints.
    std::string output(const std::string& arguments) const {
        const Outcome outcome = run(arguments);
        CAPTURE(arguments);
        CAPTURE(outcome.err);
        REQUIRE(outcome.exit_code == 0);
        CHECK(outcome.err.empty());
        return outcome.out;
    }
    [[nodiscard]] const TempDir& dir() const { return dir_; }

private:
    TempDir dir_;
};

/// A program with a small scene and its 32 x 24 primary rays.
class ProgramWithScene : public Program {
public:
    explicit ProgramWithScene(const std::string& kind = "sphere") {
        output("make " + kind + " -o scene.glb --triangles 2000");
        output("rays scene.glb primary -o rays.npy --size 32x24");
    }
};

void check_failure(const Outcome& outcome, int exit_code, const std::string& message) {
    CAPTURE(outcome.err);
    CHECK(outcome.exit_code == exit_code);
    CHECK(outcome.err.find(message) != std::string::npos);
    CHECK(outcome.out.empty());
}

std::vector<std::string> keys(const json& object) {
    std::vector<std::string> names;
    for (const auto& [key, value] : object.items()) names.push_back(key);  // sorted
    return names;
}

/// The data of an array file of `size` bytes.
std::string data_of(const std::filesystem::path& path, std::size_t size) {
    const std::string file = read_text(path);
    REQUIRE(file.size() > size);
    return file.substr(file.size() - size);
}

std::vector<Hit> read_hits(const std::filesystem::path& path, std::size_t count) {
    std::vector<Hit> hits(count);
    const std::string data = data_of(path, count * sizeof(Hit));
    std::memcpy(hits.data(), data.data(), data.size());
    return hits;
}

struct Pixels {
    int width = 0, height = 0;
    std::vector<unsigned char> rgb;

    [[nodiscard]] int at(int x, int y, int channel) const {
        const std::ptrdiff_t pixel = std::ptrdiff_t{y} * width + x;
        return rgb.begin()[3 * pixel + channel];
    }
};

Pixels read_png(const std::filesystem::path& path) {
    Pixels pixels;
    int channels = 0;
    const std::unique_ptr<unsigned char, decltype(&stbi_image_free)> data(
        stbi_load(path.c_str(), &pixels.width, &pixels.height, &channels, 0), &stbi_image_free);
    REQUIRE(data != nullptr);
    REQUIRE(channels == 3);
    const std::ptrdiff_t size = std::ptrdiff_t{3} * pixels.width * pixels.height;
    pixels.rgb.assign(data.get(), data.get() + size);
    return pixels;
}

TEST_CASE("without arguments the program prints help with examples") {
    const Program program;
    const std::string help = program.output("");
    for (const char* word : {"info", "render", "trace", "rays", "make", "packet make city"}) {
        CHECK(help.find(word) != std::string::npos);
    }
    CHECK(program.output("--help") == help);
    CHECK(program.output("trace --help").find("--query") != std::string::npos);
    CHECK(program.output("--version").find("packet ") == 0);
}

TEST_CASE("unknown names list the valid ones") {
    const ProgramWithScene program;
    check_failure(program.run("tarce"), 2, "valid are: info, render, trace, rays, make");
    check_failure(program.run("make teapot -o x.glb"), 2,
                  "valid are: terrain, city, hairball, soup, sphere, stadium");
    check_failure(program.run("rays scene.glb x-rays -o x.npy"), 2,
                  "valid are: primary, shadow, ao, diffuse, random");
    check_failure(program.run("render scene.glb -o x.png --shading toon"), 2,
                  "valid are: normal, depth, ao, heat, path");
    const std::string trace = "trace scene.glb rays.npy ";
    check_failure(program.run(trace + "--query most"), 2, "valid are: closest, any");
    check_failure(program.run(trace + "--accel fast"), 2, "bvh");
    check_failure(program.run(trace + "--mode fast"), 2, "packet8");
    check_failure(program.run(trace + "--isa mmx"), 2, "sse42");
    check_failure(program.run(trace + "--device gpu"), 2, "valid are: cpu, cuda");
    check_failure(program.run(trace + "--quality best"), 2, "valid are: fast, balanced, high");
    check_failure(program.run(trace, "PACKET_ISA=mmx"), 2, "sse42");
}

TEST_CASE("a quality chooses the builder of the bvh, and of nothing else") {
    const ProgramWithScene program;
    const std::string trace = "trace scene.glb rays.npy --json ";
    const auto accel = [&](const std::string& options) {
        return json::parse(program.output(trace + options))["accel"];
    };
    CHECK(accel("--quality fast") == "bvh-morton");
    CHECK(accel("--quality balanced") == "bvh");
    CHECK(accel("--accel bvh --quality high") == "bvh-spatial");
    CHECK(accel("--quality balanced --accel octree") == "octree");
    const char* const message = "quality 'high' chooses how bvh is built; there is none of octree";
    check_failure(program.run(trace + "--quality high --accel octree"), 2, message);
    check_failure(program.run("render none.glb -o x.png --accel octree --quality high"), 2,
                  message);
}

TEST_CASE("bad command lines exit with 2") {
    const ProgramWithScene program;
    const auto check_refused = [&](const std::string& flag, const std::string& value) {
        CAPTURE(value);
        check_failure(program.run("render scene.glb -o x.png " + flag + " '" + value + "'"), 2,
                      flag);
    };
    for (const char* size : {"0x0", "-1x4", "4", "4x4x4", "100000x1", "axb", "4x", ""}) {
        check_refused("--size", size);
    }
    for (const char* fov : {"0", "180", "-20", "nan", "inf", "wide"}) check_refused("--fov", fov);
    for (const char* eye : {"1,2", "1,2,3,4", "nan,0,0", "1e99,0,0", "a,b,c", "1;2;3"}) {
        check_refused("--eye", eye);
    }
    check_refused("--samples", "-1");
    check_failure(program.run("render scene.glb -o x.png --eye 1,2,3 --at 1,2,3"), 2, "same point");
    check_failure(program.run("trace scene.glb rays.npy --threads -1"), 2, "--threads");
    check_failure(program.run("trace scene.glb rays.npy --repeat 0"), 2, "--repeat");
    check_failure(program.run("trace scene.glb rays.npy --width -3"), 2, "--width");
    check_failure(program.run("trace scene.glb"), 2, "rays");
    check_failure(program.run("trace scene.glb rays.npy more"), 2, "more");
    check_failure(program.run("render scene.glb"), 2, "--output");
    check_failure(program.run("make soup -o x.glb --triangles 0"), 2, "--triangles");
    check_failure(program.run("make soup -o x.glb --triangles 1e6"), 2, "--triangles");
    check_failure(program.run("make soup -o x.glb --bogus"), 2, "--bogus");
    CHECK_FALSE(std::filesystem::exists(program.dir() / "x.png"));
}

TEST_CASE("bad data exit with 1 and leave nothing behind") {
    const ProgramWithScene program;
    write_text(program.dir() / "bad.glb", "glTF nonsense");
    write_text(program.dir() / "bad.npy", "NUMPY nonsense");
    program.run("");  // so that its two files are there when files are counted
    const std::size_t files = program.dir().file_count();
    check_failure(program.run("info missing.glb"), 1, "missing.glb");
    check_failure(program.run("info bad.glb"), 1, "bad.glb");
    check_failure(program.run("render bad.glb -o x.png"), 1, "bad.glb");
    check_failure(program.run("trace scene.glb missing.npy -o x.npy"), 1, "missing.npy");
    check_failure(program.run("trace scene.glb bad.npy -o x.npy"), 1, "bad.npy");
    check_failure(program.run("rays scene.glb ao -o x.npy --eye 9,9,9 --at 99,99,99"), 1,
                  "sees nothing");
    check_failure(program.run("make soup -o no/x.glb"), 1, "no/x.glb");
    check_failure(program.run("make soup -o ."), 1, "cannot write");
    check_failure(program.run("make soup -o /dev/full"), 1, "/dev/full");
    CHECK(program.dir().file_count() == files);
}

TEST_CASE("output that nobody takes is an error") {
    const ProgramWithScene program;
    CHECK(program.run("info scene.glb >/dev/full").exit_code == 1);
    CHECK(program.run(">/dev/full").err.find("stdout") != std::string::npos);
}

TEST_CASE("info describes the scene") {
    const ProgramWithScene program;
    CHECK(program.output("info scene.glb").find("triangles") != std::string::npos);
    const json info = json::parse(program.output("info scene.glb --json"));
    CHECK(keys(info) == std::vector<std::string>{"bounds", "scene", "skipped"});
    CHECK(info["scene"] == json{{"triangles", 1800}, {"meshes", 1}, {"instances", 1}});
    CHECK(info["bounds"] == json{{"lower", {-1, -1, -1}}, {"upper", {1, 1, 1}}});
    CHECK(info["skipped"]["zero_area"] == 0);
}

TEST_CASE("trace reports one JSON object") {
    const ProgramWithScene program;
    const std::string trace = "trace scene.glb rays.npy --json --repeat 3 --threads 1 ";
    json report = json::parse(program.output(trace));
    CHECK(keys(report) == std::vector<std::string>{"accel", "build", "device", "hits", "isa",
                                                   "mode", "query", "rays", "scene", "stats",
                                                   "threads", "trace"});
    CHECK(report["scene"] == json{{"triangles", 1800}, {"instances", 1}});
    CHECK(keys(report["build"]) == std::vector<std::string>{"bytes", "sah_cost", "seconds"});
    CHECK(report["device"] == "cpu");
    CHECK(keys(report["trace"]) == std::vector<std::string>{"mrays_per_s", "repeats", "seconds"});
    CHECK(report["trace"]["repeats"] == 3);
    CHECK(report["rays"] == 32 * 24);
    CHECK(report["threads"] == 1);
    CHECK(report["accel"] == "bvh");
    CHECK(report["mode"] == "auto");
    CHECK(report["query"] == "closest");
    const std::vector<std::string> stats = {"lane_utilization", "nodes_per_ray",
                                            "triangles_per_ray"};
    CHECK(keys(report["stats"]) == stats);
    for (const std::string& key : stats) CHECK(report["stats"][key].is_null());

    report = json::parse(program.output(trace + "--stats --query any --mode single --isa scalar"));
    CHECK(report["query"] == "any");
    CHECK(report["mode"] == "single");
    CHECK(report["isa"] == "scalar");
    for (const std::string& key : stats) CHECK(report["stats"][key].is_number());
}

TEST_CASE("trees are cut into treelets for the mode that needs them, or as told") {
    const ProgramWithScene program;
    const auto stats = [&](const std::string& options) {
        return json::parse(
            program.output("trace scene.glb rays.npy --json --stats " + options))["stats"];
    };
    CHECK(stats("--mode treelet")["treelets"]["count"] == 1);
    CHECK(stats("--mode treelet --treelet-bytes 5000")["treelets"]["count"] > 1);
    CHECK(stats("--treelet-bytes 5000 --mode treelet")["treelets"]["count"] > 1);
    CHECK(!stats("--mode treelet --treelet-bytes 0").contains("treelets"));
    CHECK(!stats("--mode stream").contains("treelets"));
}

TEST_CASE("trace writes a record for each ray, in the rays' order") {
    const ProgramWithScene program;
    program.output("trace scene.glb rays.npy -o hits.npy --width 32");
    const std::string file = read_text(program.dir() / "hits.npy");
    CHECK(file.find("{'descr': [('t', '<f4'), ('u', '<f4'), ('v', '<f4'), ('prim_id', '<u4'), "
                    "('mesh_id', '<u4'), ('instance_id', '<u4')], 'fortran_order': False, "
                    "'shape': (768,), }") == 10);
    const std::vector<Ray> rays = read_rays(program.dir() / "rays.npy");
    const std::vector<Hit> hits = read_hits(program.dir() / "hits.npy", rays.size());
    CHECK_FALSE(hits.front().is_hit());  // the corner of the image
    CHECK(hits.front() == Hit{});
    CHECK(hits[12 * 32 + 16].is_hit());  // its middle
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!hits[i].is_hit()) continue;
        REQUIRE(glm::length(rays[i].org + hits[i].t * rays[i].dir) ==
                doctest::Approx(1.0).epsilon(0.01));
    }
    program.output("trace scene.glb rays.npy -o other.npy --threads 1 --mode packet8");
    CHECK(read_text(program.dir() / "other.npy") == file);
}

TEST_CASE("an any-hit query writes a byte for each ray") {
    const ProgramWithScene program;
    program.output("trace scene.glb rays.npy -o any.npy --query any");
    program.output("trace scene.glb rays.npy -o hits.npy");
    const std::string file = read_text(program.dir() / "any.npy");
    CHECK(file.find("{'descr': '|u1', 'fortran_order': False, 'shape': (768,), }") == 10);
    const std::string bytes = data_of(program.dir() / "any.npy", 768);
    const std::vector<Hit> hits = read_hits(program.dir() / "hits.npy", 768);
    for (std::size_t i = 0; i < hits.size(); ++i) REQUIRE((bytes[i] == 1) == hits[i].is_hit());
}

TEST_CASE("a CUDA device gives the same hits, or is told to be missing") {
    const ProgramWithScene program;
    program.output("trace scene.glb rays.npy -o hits.npy");
    const Outcome outcome = program.run("trace scene.glb rays.npy -o cuda.npy --device cuda");
    if (outcome.exit_code != 0) {
        check_failure(outcome, 2, "CUDA");
        check_failure(program.run("render scene.glb -o x.png --device cuda"), 2, "CUDA");
        CHECK(!std::filesystem::exists(program.dir() / "cuda.npy"));
        return;
    }
    CHECK(read_text(program.dir() / "cuda.npy") == read_text(program.dir() / "hits.npy"));
    program.output("render scene.glb -o cpu.png --size 64x64 --shading path");
    program.output("render scene.glb -o cuda.png --size 64x64 --shading path --device cuda");
    CHECK(read_text(program.dir() / "cuda.png") == read_text(program.dir() / "cpu.png"));
}

TEST_CASE("no rays are traced as well") {
    const ProgramWithScene program;
    write_rays(OutputFile(program.dir() / "none.npy"), {});
    const json report =
        json::parse(program.output("trace scene.glb none.npy -o hits.npy --stats --json"));
    CHECK(report["rays"] == 0);
    CHECK(read_text(program.dir() / "hits.npy").find("'shape': (0,)") != std::string::npos);
}

TEST_CASE("a flattened scene gives the same hits for one instance") {
    const ProgramWithScene program("city");
    program.output("trace scene.glb rays.npy -o hits.npy");
    program.output("trace scene.glb rays.npy -o flat.npy --flatten");
    CHECK(read_text(program.dir() / "hits.npy") == read_text(program.dir() / "flat.npy"));
}

TEST_CASE("every kind of rays is as many as the pixels, and the same for the same seed") {
    const ProgramWithScene program("hairball");
    for (const std::string kind : {"primary", "shadow", "ao", "diffuse", "random"}) {
        CAPTURE(kind);
        const std::string rays = "rays scene.glb " + kind + " --size 16x12 ";
        program.output(rays + "-o a.npy --seed 5");
        program.output(rays + "-o b.npy --seed 5 --threads 1");
        program.output(rays + "-o c.npy --seed 6");
        const std::string a = read_text(program.dir() / "a.npy");
        CHECK(read_rays(program.dir() / "a.npy").size() == 16 * 12);
        CHECK(read_text(program.dir() / "b.npy") == a);
        CHECK((read_text(program.dir() / "c.npy") == a) == (kind == "primary"));
        program.output("trace scene.glb a.npy");
    }
}

TEST_CASE("rays that start on a closed surface do not meet it where they start") {
    const ProgramWithScene program("sphere");
    for (const std::string kind : {"shadow", "ao", "diffuse"}) {
        CAPTURE(kind);
        program.output("rays scene.glb " + kind + " -o out.npy --size 64x48");
        const json report =
            json::parse(program.output("trace scene.glb out.npy --json --query any"));
        // A sphere is convex: nothing is met from outside but by a light's ray from the dark side.
        if (kind != "shadow") CHECK(report["hits"] == 0);
        if (kind == "shadow") CHECK(report["hits"] < 64 * 48 / 2);
    }
}

TEST_CASE("the default camera sees all of the scene") {
    const Program program;
    for (const std::string kind : {"sphere", "terrain", "city"}) {
        program.output("make " + kind + " -o scene.glb --triangles 5000");
        for (const std::string camera : {"64x48", "64x48 --fov 10", "31x77", "50x50 --up 0,0,1"}) {
            CAPTURE(kind);
            CAPTURE(camera);
            program.output("render scene.glb -o x.png --shading depth --size " + camera);
            const Pixels image = read_png(program.dir() / "x.png");
            int seen_at_border = 0, seen = 0;
            for (int y = 0; y < image.height; ++y) {
                for (int x = 0; x < image.width; ++x) {
                    if (image.at(x, y, 0) == 0) continue;  // the background
                    const bool inner =
                        x > 0 && y > 0 && x + 1 < image.width && y + 1 < image.height;
                    ++(inner ? seen : seen_at_border);
                }
            }
            CHECK(seen_at_border == 0);
            CHECK(seen > image.width * image.height / 16);
        }
    }
}

TEST_CASE("every shading renders an image of the size wished that shows something") {
    const ProgramWithScene program("city");
    for (const std::string shading : {"normal", "depth", "ao", "heat", "path"}) {
        CAPTURE(shading);
        const std::string render = "render scene.glb --samples 2 --size 40x30 --shading " + shading;
        program.output(render + " -o a.png");
        program.output(render + " -o b.png --threads 1");
        const Pixels image = read_png(program.dir() / "a.png");
        CHECK(image.width == 40);
        CHECK(image.height == 30);
        const auto [darkest, lightest] = std::minmax_element(image.rgb.begin(), image.rgb.end());
        CHECK(*lightest - *darkest > 60);
        CHECK(read_png(program.dir() / "b.png").rgb == image.rgb);
    }
}

TEST_CASE("an image is upright: up is up and right is right") {
    const ProgramWithScene program("sphere");
    program.output("render scene.glb -o x.png --size 33x33 --eye 0,0,4 --at 0,0,0");
    const Pixels image = read_png(program.dir() / "x.png");
    CHECK(image.at(16, 8, 1) > image.at(16, 24, 1) + 50);  // normals to +y at the top
    CHECK(image.at(24, 16, 0) > image.at(8, 16, 0) + 50);  // and to +x at the right
    CHECK(image.at(16, 16, 2) > 250);                      // and to the camera in the middle
}

TEST_CASE("a camera whose up is along its view finds another up") {
    const ProgramWithScene program("sphere");
    program.output("render scene.glb -o x.png --size 16x16 --eye 0,5,0 --at 0,0,0");
    program.output("render scene.glb -o y.png --size 16x16 --up 0,0,0");
    CHECK(read_png(program.dir() / "x.png").at(8, 8, 1) > 240);
}

}  // namespace
}  // namespace packet::tools
