// Owners of what the CUDA runtime hands out, and its errors as packet::Error.
#pragma once

#include "device.h"

#include <packet/error.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <utility>

namespace packet::cuda {

/// Throws Error{kUnsupported} that says what failed and why.
inline void check(cudaError_t error, const char* what) {
    if (error == cudaSuccess) return;
    throw Error(ErrorCode::kUnsupported,
                std::string("CUDA: ") + what + ": " + cudaGetErrorString(error));
}

/// Of the device in use.
[[nodiscard]] inline int device_attribute(cudaDeviceAttr which) {
    int device = 0, value = 0;
    check(cudaGetDevice(&device), "cudaGetDevice");
    check(cudaDeviceGetAttribute(&value, which, device), "cudaDeviceGetAttribute");
    return value;
}

class Stream {
public:
    Stream() { check(cudaStreamCreate(&stream_), "cudaStreamCreate"); }
    ~Stream() { cudaStreamDestroy(stream_); }
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;

    [[nodiscard]] cudaStream_t get() const noexcept { return stream_; }
    /// Waits for all that has been put into it.
    void synchronize() const { check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize"); }

private:
    cudaStream_t stream_ = nullptr;
};

/// Memory of the device, not initialised.
template <class T>
class DeviceArray {
public:
    DeviceArray() = default;
    explicit DeviceArray(std::size_t count) : count_(count) {
        if (count != 0) check(cudaMalloc(&data_, count * sizeof(T)), "cudaMalloc");
    }
    /// With these values. The span may go as soon as this returns.
    explicit DeviceArray(std::span<const T> values) : DeviceArray(values.size()) {
        const Stream stream;
        copy_from(values, stream.get());
        stream.synchronize();
    }
    ~DeviceArray() { cudaFree(data_); }
    DeviceArray(DeviceArray&& other) noexcept
        : data_(std::exchange(other.data_, nullptr)), count_(std::exchange(other.count_, 0)) {}
    DeviceArray& operator=(DeviceArray&& other) noexcept {
        std::swap(data_, other.data_);
        std::swap(count_, other.count_);
        return *this;
    }

    [[nodiscard]] T* data() const noexcept { return data_; }
    [[nodiscard]] std::size_t size() const noexcept { return count_; }

    /// At least so many, all of unknown value if there were fewer.
    void make_room(std::size_t count) {
        if (count <= count_) return;
        *this = DeviceArray();  // given back first: both need not fit
        *this = DeviceArray(count);
    }
    /// At least so many, of which the first `kept` stay. Room doubles, since it is asked for often.
    void grow(std::size_t count, std::size_t kept, const Stream& stream) {
        if (count <= count_) return;
        DeviceArray larger(std::max(count, 2 * count_));
        larger.copy_on_device(data_, kept, stream.get());
        stream.synchronize();  // before the old memory is given back
        *this = std::move(larger);
    }

    // These are done in the stream's order; what is on the host must stay until then.
    void copy_from(std::span<const T> values, cudaStream_t stream) {
        if (values.empty()) return;
        check(cudaMemcpyAsync(data_, values.data(), values.size_bytes(), cudaMemcpyHostToDevice,
                              stream),
              "copy to the device");
    }
    void copy_to(std::span<T> values, cudaStream_t stream) const {
        if (values.empty()) return;
        check(cudaMemcpyAsync(values.data(), data_, values.size_bytes(), cudaMemcpyDeviceToHost,
                              stream),
              "copy from the device");
    }
    void copy_on_device(const T* values, std::size_t count, cudaStream_t stream) {
        if (count == 0) return;
        check(cudaMemcpyAsync(data_, values, count * sizeof(T), cudaMemcpyDeviceToDevice, stream),
              "copy on the device");
    }
    void copy_value(std::size_t index, T* to, cudaStream_t stream) const {
        check(cudaMemcpyAsync(to, data_ + index, sizeof(T), cudaMemcpyDeviceToHost, stream),
              "copy from the device");
    }
    /// Waits for what is in the stream.
    [[nodiscard]] T value(std::size_t index, const Stream& stream) const {
        T out;
        copy_value(index, &out, stream.get());
        stream.synchronize();
        return out;
    }
    void fill_bytes(int byte, cudaStream_t stream) {
        check(cudaMemsetAsync(data_, byte, count_ * sizeof(T), stream), "cudaMemset");
    }

private:
    T* data_ = nullptr;
    std::size_t count_ = 0;
};

}  // namespace packet::cuda
