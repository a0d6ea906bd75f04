// Rays and hits as NumPy array files.
#include "npy.h"

#include "npy_header.h"

#include <packet/error.h>

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstddef>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace packet::tools {
namespace {

static_assert(std::endian::native == std::endian::little,
              "arrays are written as they lie in memory");
static_assert(sizeof(Ray) == 8 * sizeof(float) && offsetof(Ray, dir) == 4 * sizeof(float));
static_assert(sizeof(Hit) == 24 && offsetof(Hit, instance_id) == 20);

// NumPy's own limit for a header that it reads without being told to trust the file.
constexpr std::uint64_t kMaxHeaderBytes = 10'000;

constexpr std::string_view kHitRecord =
    "[('t', '<f4'), ('u', '<f4'), ('v', '<f4'), "
    "('prim_id', '<u4'), ('mesh_id', '<u4'), ('instance_id', '<u4')]";

/// A file that is read from front to back, no further than it reaches.
class InputFile {
public:
    explicit InputFile(const std::filesystem::path& path) : name_(path.string()) {
        std::error_code error;
        remaining_ = std::filesystem::file_size(path, error);  // refuses what is no regular file
        if (!error) stream_.open(path, std::ios::binary);
        if (!error && !stream_) error = std::error_code(errno, std::generic_category());
        if (error) {
            throw Error(ErrorCode::kIo,
                        fmt::format("cannot read '{}': {}", name_, error.message()));
        }
    }

    [[noreturn]] void fail(std::string_view why) const {
        throw Error(ErrorCode::kBadFile, fmt::format("'{}': {}", name_, why));
    }
    void read(std::span<std::byte> bytes) {
        if (bytes.size() > remaining_) fail("the file is truncated");
        const auto count = static_cast<std::streamsize>(bytes.size());
        stream_.read(reinterpret_cast<char*>(bytes.data()), count);
        if (stream_.gcount() != count) {
            throw Error(ErrorCode::kIo, fmt::format("cannot read '{}'", name_));
        }
        remaining_ -= bytes.size();
    }
    [[nodiscard]] std::uint64_t remaining() const noexcept { return remaining_; }
    [[nodiscard]] const std::string& name() const noexcept { return name_; }

private:
    std::string name_;
    std::ifstream stream_;
    std::uint64_t remaining_ = 0;
};

NpyHeader read_header(InputFile& file) {
    std::array<std::uint8_t, 8> prefix{};
    file.read(std::as_writable_bytes(std::span(prefix)));
    constexpr std::array<std::uint8_t, 6> kMagic = {0x93, 'N', 'U', 'M', 'P', 'Y'};
    if (!std::equal(kMagic.begin(), kMagic.end(), prefix.begin())) file.fail("not an NPY file");
    const int major = prefix[6], minor = prefix[7];
    if (major < 1 || major > 3 || minor != 0) {
        file.fail(
            fmt::format("NPY version {}.{}; versions 1.0, 2.0 and 3.0 are read", major, minor));
    }
    std::uint32_t size = 0;  // 2 bytes in version 1.0, then 4
    file.read(std::as_writable_bytes(std::span(&size, 1)).first(major == 1 ? 2 : 4));
    if (size > kMaxHeaderBytes) file.fail(fmt::format("the NPY header has {} bytes", size));
    std::string text(size, '\0');
    file.read(std::as_writable_bytes(std::span(text)));
    return parse_npy_header(text, file.name());
}

/// The number of rays in the rest of the file.
std::size_t check_rays(const NpyHeader& header, const InputFile& file) {
    if (header.descr != "<f4") file.fail("dtype is '" + header.descr + "', rays need '<f4'");
    if (header.fortran_order) file.fail("Fortran order, rays need C order");
    if (header.shape.size() != 2 || header.shape[1] != 8) {
        file.fail(fmt::format("shape is ({}), rays need (n, 8)", fmt::join(header.shape, ", ")));
    }
    const std::uint64_t count = header.shape[0];
    const std::uint64_t bytes = file.remaining();  // compared by division: a product could overflow
    if (bytes / sizeof(Ray) != count || bytes % sizeof(Ray) != 0) {
        file.fail(fmt::format("{} bytes of data do not make {} rays; the file is {}", bytes, count,
                              bytes / sizeof(Ray) < count ? "truncated" : "too long"));
    }
    return count;
}

template <class T>
void write_array(OutputFile file, std::string_view descr, std::string_view shape,
                 std::span<const T> values) {
    file.write(format_npy_header(descr, shape));
    file.write(std::as_bytes(values));
    file.commit();
}

}  // namespace

std::vector<Ray> read_rays(const std::filesystem::path& path) {
    InputFile file(path);
    const NpyHeader header = read_header(file);
    std::vector<Ray> rays(check_rays(header, file));
    file.read(std::as_writable_bytes(std::span(rays)));
    return rays;
}

void write_rays(OutputFile file, std::span<const Ray> rays) {
    write_array(std::move(file), "'<f4'", fmt::format("({}, 8)", rays.size()), rays);
}

void write_hits(OutputFile file, std::span<const Hit> hits) {
    write_array(std::move(file), kHitRecord, fmt::format("({},)", hits.size()), hits);
}

void write_occluded(OutputFile file, std::span<const std::uint8_t> occluded) {
    write_array(std::move(file), "'|u1'", fmt::format("({},)", occluded.size()), occluded);
}

}  // namespace packet::tools
