// A scene and rays to trace in it, as a benchmark.
#pragma once

#include <packet/isa.h>
#include <packet/ray.h>
#include <packet/scene.h>
#include <packet/trace.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace packet::bench {

/// What is made when it is first asked for. Copies share it.
template <class T>
class Lazy {
public:
    explicit Lazy(std::function<T()> make)
        : state_(std::make_shared<State>(State{std::move(make), {}})) {}

    [[nodiscard]] const T& get() const {
        if (!state_->value) state_->value.emplace(state_->make());
        return *state_->value;
    }

private:
    struct State {
        std::function<T()> make;
        std::optional<T> value;
    };
    std::shared_ptr<State> state_;
};

struct Course {
    Scene scene;  ///< committed
    std::vector<Ray> rays;
    int width = 0;  ///< of the image whose rays they are in scanline order; 0 if they are not
};

/// Registers a benchmark of closest hits on one thread, by an instruction set or else the best. Its
/// counters: rays/s, nodes/ray, triangles/ray and lanes_used, the share of lanes that do work.
void add_course(const std::string& name, const Lazy<Course>& course, Mode mode,
                std::optional<IsaId> isa = {});

}  // namespace packet::bench
