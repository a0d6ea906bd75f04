#include "embree_reference.h"

#include "spread.h"

#include <timing.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace packet::bench {
namespace {

// A call into Embree. Its two versions differ in nothing else here. What is passed decides the
// query: a ray with room for a hit asks for the closest hit, a bare ray for any.
#if RTC_VERSION_MAJOR >= 4
class Call {
public:
    Call(RTCScene scene, bool coherent) : scene_(scene) {
        rtcInitIntersectArguments(&closest_);
        rtcInitOccludedArguments(&any_);
        if (coherent) closest_.flags = any_.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    }
    void operator()(RTCRayHit& ray) { rtcIntersect1(scene_, &ray, &closest_); }
    void operator()(RTCRay& ray) { rtcOccluded1(scene_, &ray, &any_); }
    void operator()(const int* valid, RTCRayHit8& r) {
        rtcIntersect8(valid, scene_, &r, &closest_);
    }
    void operator()(const int* valid, RTCRay8& r) { rtcOccluded8(valid, scene_, &r, &any_); }
    void operator()(const int* valid, RTCRayHit16& r) {
        rtcIntersect16(valid, scene_, &r, &closest_);
    }
    void operator()(const int* valid, RTCRay16& r) { rtcOccluded16(valid, scene_, &r, &any_); }
    void operator()(std::span<RTCRayHit> rays) { std::ranges::for_each(rays, std::ref(*this)); }
    void operator()(std::span<RTCRay> rays) { std::ranges::for_each(rays, std::ref(*this)); }

private:
    RTCScene scene_;
    RTCIntersectArguments closest_;
    RTCOccludedArguments any_;
};
#else
class Call {
public:
    Call(RTCScene scene, bool coherent) : scene_(scene) {
        rtcInitIntersectContext(&context_);
        if (coherent) context_.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    }
    void operator()(RTCRayHit& ray) { rtcIntersect1(scene_, &context_, &ray); }
    void operator()(RTCRay& ray) { rtcOccluded1(scene_, &context_, &ray); }
    void operator()(const int* valid, RTCRayHit8& r) {
        rtcIntersect8(valid, scene_, &context_, &r);
    }
    void operator()(const int* valid, RTCRay8& r) { rtcOccluded8(valid, scene_, &context_, &r); }
    void operator()(const int* valid, RTCRayHit16& r) {
        rtcIntersect16(valid, scene_, &context_, &r);
    }
    void operator()(const int* valid, RTCRay16& r) { rtcOccluded16(valid, scene_, &context_, &r); }
    void operator()(std::span<RTCRayHit> rays) {
        rtcIntersect1M(scene_, &context_, rays.data(), static_cast<unsigned>(rays.size()),
                       sizeof(RTCRayHit));
    }
    void operator()(std::span<RTCRay> rays) {
        rtcOccluded1M(scene_, &context_, rays.data(), static_cast<unsigned>(rays.size()),
                      sizeof(RTCRay));
    }

private:
    RTCScene scene_;
    RTCIntersectContext context_;
};
#endif

// The types that go with what is asked for.
template <class Answer>
struct Query;
template <>
struct Query<Hit> {
    using One = RTCRayHit;
    using Eight = RTCRayHit8;
    using Sixteen = RTCRayHit16;
};
template <>
struct Query<std::uint8_t> {
    using One = RTCRay;
    using Eight = RTCRay8;
    using Sixteen = RTCRay16;
};

void set(RTCRay& out, const Ray& ray) {
    out = {ray.org.x, ray.org.y, ray.org.z, ray.tnear, ray.dir.x, ray.dir.y,
           ray.dir.z, 0.0f,      ray.tfar,  ~0u,       0,         0};
}
void set(RTCRayHit& out, const Ray& ray) {
    set(out.ray, ray);
    out.hit.geomID = out.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

Hit get(const RTCRayHit& in) {
    if (in.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    return {in.ray.tfar, in.hit.u, in.hit.v, in.hit.primID, 0, 0};
}
std::uint8_t get(const RTCRay& in) { return in.tfar < 0.0f ? 1 : 0; }  // -inf says that it hit

template <class Packet>
concept WithHit = requires(Packet packet) {
    packet.hit;
};

template <class Packet>
void set_lane(Packet& out, int lane, const Ray& ray) {
    if constexpr (WithHit<Packet>) {
        set_lane(out.ray, lane, ray);
        out.hit.geomID[lane] = out.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    } else {
        out.org_x[lane] = ray.org.x, out.org_y[lane] = ray.org.y, out.org_z[lane] = ray.org.z;
        out.dir_x[lane] = ray.dir.x, out.dir_y[lane] = ray.dir.y, out.dir_z[lane] = ray.dir.z;
        out.tnear[lane] = ray.tnear, out.tfar[lane] = ray.tfar;
        out.time[lane] = 0.0f, out.mask[lane] = ~0u, out.flags[lane] = 0;
    }
}

template <class Packet>
auto get_lane(const Packet& in, int lane) {
    if constexpr (WithHit<Packet>) {
        if (in.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID) return Hit{};
        return Hit{in.ray.tfar[lane], in.hit.u[lane], in.hit.v[lane], in.hit.primID[lane], 0, 0};
    } else {
        return static_cast<std::uint8_t>(in.tfar[lane] < 0.0f ? 1 : 0);
    }
}

template <class Answer>
void trace_single(Call call, std::span<const Ray> rays, std::span<Answer> answers) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
        typename Query<Answer>::One ray;
        set(ray, rays[i]);
        call(ray);
        answers[i] = get(ray);
    }
}

template <class Packet, int N, class Answer>
void trace_packets(Call call, std::span<const Ray> rays, std::span<Answer> answers) {
    for (std::size_t first = 0; first < rays.size(); first += N) {
        const int count = static_cast<int>(std::min<std::size_t>(N, rays.size() - first));
        alignas(4 * N) std::array<int, N> valid{};
        Packet packet;
        for (int lane = 0; lane < count; ++lane) {
            valid[static_cast<std::size_t>(lane)] = -1;
            set_lane(packet, lane, rays[first + static_cast<std::size_t>(lane)]);
        }
        call(valid.data(), packet);
        for (int lane = 0; lane < count; ++lane) {
            answers[first + static_cast<std::size_t>(lane)] = get_lane(packet, lane);
        }
    }
}

// Rays a stream: enough for Embree to sort by octant, few enough to stay in the cache.
constexpr std::size_t kStreamSize = 1024;

template <class Answer>
void trace_streams(Call call, std::span<const Ray> rays, std::span<Answer> answers) {
    std::vector<typename Query<Answer>::One> stream(std::min(kStreamSize, rays.size()));
    for (std::size_t first = 0; first < rays.size(); first += kStreamSize) {
        const std::size_t count = std::min(kStreamSize, rays.size() - first);
        for (std::size_t i = 0; i < count; ++i) set(stream[i], rays[first + i]);
        call(std::span(stream.data(), count));
        for (std::size_t i = 0; i < count; ++i) answers[first + i] = get(stream[i]);
    }
}

template <class Answer>
void trace_some(RTCScene scene, EmbreeMode mode, std::span<const Ray> rays,
                std::span<Answer> answers) {
    using Eight = typename Query<Answer>::Eight;
    using Sixteen = typename Query<Answer>::Sixteen;
    const Call plain(scene, false);
    const Call coherent(scene, true);
    switch (mode) {
        case EmbreeMode::k1: return trace_single(plain, rays, answers);
        case EmbreeMode::k8: return trace_packets<Eight, 8>(plain, rays, answers);
        case EmbreeMode::k8Coherent: return trace_packets<Eight, 8>(coherent, rays, answers);
        case EmbreeMode::k16: return trace_packets<Sixteen, 16>(plain, rays, answers);
        case EmbreeMode::k16Coherent: return trace_packets<Sixteen, 16>(coherent, rays, answers);
        case EmbreeMode::k1M: return trace_streams(plain, rays, answers);
        case EmbreeMode::k1MCoherent: return trace_streams(coherent, rays, answers);
    }
}

// Rays a task: whole packets and streams, and enough of them to hide the cost of a task.
constexpr std::size_t kTaskSize = 4 * kStreamSize;

template <class Answer>
void trace_all(RTCScene scene, EmbreeMode mode, std::span<const Ray> rays,
               std::span<Answer> answers, int threads) {
    if (rays.size() != answers.size()) throw std::invalid_argument("as many answers as rays");
    spread(rays.size(), kTaskSize, threads, [&](std::size_t first, std::size_t count) {
        trace_some(scene, mode, rays.subspan(first, count), answers.subspan(first, count));
    });
}

RTCBuildQuality to_embree(EmbreeQuality quality) {
    switch (quality) {
        case EmbreeQuality::kLow: return RTC_BUILD_QUALITY_LOW;
        case EmbreeQuality::kMedium: return RTC_BUILD_QUALITY_MEDIUM;
        case EmbreeQuality::kHigh: return RTC_BUILD_QUALITY_HIGH;
    }
    return RTC_BUILD_QUALITY_MEDIUM;
}

// The scene takes the geometry over, and the device keeps the arrays.
void attach(RTCDevice device, RTCScene scene, MeshView mesh, RTCBuildQuality quality) {
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* positions =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                sizeof(glm::vec3), mesh.positions.size());
    void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              sizeof(glm::uvec3), mesh.triangles.size());
    if (positions && triangles) {
        std::ranges::copy(mesh.positions, static_cast<glm::vec3*>(positions));
        std::ranges::copy(mesh.triangles, static_cast<glm::uvec3*>(triangles));
        // Low quality is only had if the geometry asks for it, too; high is the scene's alone.
        if (quality == RTC_BUILD_QUALITY_LOW) rtcSetGeometryBuildQuality(geometry, quality);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
    }
    rtcReleaseGeometry(geometry);
}

struct FirstError {
    RTCError code = RTC_ERROR_NONE;
    std::string message;
};

void keep_first_error(void* user, RTCError code, const char* message) {
    auto& error = *static_cast<FirstError*>(user);
    if (error.code == RTC_ERROR_NONE) error = {code, message ? message : "no message"};
}

// What Embree's threads take less what they give back.
bool count_bytes(void* user, ssize_t bytes, bool /*after*/) {
    *static_cast<std::atomic<std::ptrdiff_t>*>(user) += bytes;
    return true;
}

constexpr EmbreeModeName kModes[] = {
    {EmbreeMode::k1, "1"},
    {EmbreeMode::k8, "8"},
    {EmbreeMode::k8Coherent, "8c"},
    {EmbreeMode::k16, "16"},
    {EmbreeMode::k16Coherent, "16c"},
#if RTC_VERSION_MAJOR < 4
    {EmbreeMode::k1M, "1M"},
    {EmbreeMode::k1MCoherent, "1Mc"},
#endif
};

}  // namespace

std::span<const EmbreeModeName> embree_modes() noexcept { return kModes; }

std::string_view embree_version() noexcept { return "Embree " RTC_VERSION_STRING; }

EmbreeScene::EmbreeScene(MeshView mesh, EmbreeQuality quality, EmbreeTest test) {
    // No settings: limits on threads would bind every other user of TBB in the process too.
    const RTCDevice device = rtcNewDevice(nullptr);
    if (!device) throw std::runtime_error("Embree refuses to start on this CPU");
    FirstError error;
    rtcSetDeviceErrorFunction(device, keep_first_error, &error);
    scene_.reset(rtcNewScene(device), rtcReleaseScene);
    rtcSetSceneBuildQuality(scene_.get(), to_embree(quality));
    std::atomic<std::ptrdiff_t> bytes = 0;
    if (test == EmbreeTest::kRobust) rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    attach(device, scene_.get(), mesh, to_embree(quality));
    rtcSetDeviceMemoryMonitorFunction(device, count_bytes, &bytes);
    build_.seconds = tools::seconds_of([&] { rtcCommitScene(scene_.get()); });
    build_.bytes = static_cast<std::size_t>(bytes);
    rtcSetDeviceMemoryMonitorFunction(device, nullptr, nullptr);
    rtcSetDeviceErrorFunction(device, nullptr, nullptr);
    rtcReleaseDevice(device);  // the scene keeps it alive
    if (error.code != RTC_ERROR_NONE) throw std::runtime_error("Embree: " + error.message);
}

void EmbreeScene::trace_closest(EmbreeMode mode, std::span<const Ray> rays, std::span<Hit> hits,
                                int threads) const {
    trace_all(scene_.get(), mode, rays, hits, threads);
}

void EmbreeScene::trace_any(EmbreeMode mode, std::span<const Ray> rays,
                            std::span<std::uint8_t> occluded, int threads) const {
    trace_all(scene_.get(), mode, rays, occluded, threads);
}

}  // namespace packet::bench
