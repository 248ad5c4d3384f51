#include "batch_bindings.hpp"

#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments.hpp"
#include "batch.hpp"
#include "lander.hpp"
#include "lane_solver.hpp"
#include "snapshot.hpp"

using namespace nanobind::literals;

namespace touchdown {
namespace {

template <typename T, typename... Shape>
using Array = nb::ndarray<T, nb::numpy, nb::device::cpu, nb::c_contig, Shape...>;
using Observations = Array<float, nb::shape<-1, kObservationSize>>;
using Rewards = Array<double, nb::shape<-1>>;
using Flags = Array<bool, nb::shape<-1>>;
using States = Array<float, nb::shape<-1, kNumBodies, 6>>;

// Landers that are stepped together, and the arrays that a step needs.
struct Batch {
  explicit Batch(std::size_t count, const Config& config)
      : landers(count, make_lander(config)), throttles(count), active(count, 1) {}

  std::vector<Lander> landers;
  std::vector<Throttle> throttles;
  std::vector<unsigned char> active;
};

void need_rows(const Batch& batch, std::size_t rows, const char* name) {
  if (rows == batch.landers.size()) return;
  throw nb::value_error((std::string(name) + " has " + std::to_string(rows) + " rows, must have " +
                         std::to_string(batch.landers.size()))
                            .c_str());
}

Lander& lander_at(Batch& batch, std::int64_t index) {
  if (index < 0 || index >= static_cast<std::int64_t>(batch.landers.size())) {
    throw nb::index_error(("index " + std::to_string(index) + ": must be from 0 to " +
                           std::to_string(batch.landers.size() - 1))
                              .c_str());
  }
  return batch.landers[static_cast<std::size_t>(index)];
}

void set_active(Batch& batch, const std::optional<Flags>& active) {
  if (!active) {
    std::fill(batch.active.begin(), batch.active.end(), 1);
    return;
  }
  need_rows(batch, active->shape(0), "active");
  for (std::size_t i = 0; i < batch.active.size(); ++i) batch.active[i] = (*active)(i) ? 1 : 0;
}

void need_started(const Batch& batch) {
  for (std::size_t i = 0; i < batch.landers.size(); ++i) {
    if (batch.active[i] != 0 && batch.landers[i].started == 0) {
      throw std::runtime_error("reset environment " + std::to_string(i) +
                               " before its first step");
    }
  }
}

void step_batch(Batch& batch, const Observations& observations, const Rewards& rewards,
                const Flags& terminated) {
  need_rows(batch, observations.shape(0), "observations");
  need_rows(batch, rewards.shape(0), "rewards");
  need_rows(batch, terminated.shape(0), "terminated");
  need_started(batch);
  const Results results{observations.data(), rewards.data(), terminated.data()};
  const nb::gil_scoped_release released;
  step(batch.landers, batch.throttles, batch.active, results);
}

void step_discrete(Batch& batch, const Array<const std::int64_t, nb::shape<-1>>& actions,
                   const Observations& observations, const Rewards& rewards,
                   const Flags& terminated, const std::optional<Flags>& active) {
  need_rows(batch, actions.shape(0), "actions");
  set_active(batch, active);
  for (std::size_t i = 0; i < batch.landers.size(); ++i) {
    if (batch.active[i] == 0) continue;
    const std::int64_t action = actions(i);
    if (action < 0 || action >= kNumActions) {
      throw nb::value_error(("actions[" + std::to_string(i) + "] = " + std::to_string(action) +
                             ": must be a whole number from 0 to 3")
                                .c_str());
    }
    batch.throttles[i] = discrete_throttle(static_cast<int>(action));
  }
  step_batch(batch, observations, rewards, terminated);
}

void step_continuous(Batch& batch, const Array<const float, nb::shape<-1, 2>>& actions,
                     const Observations& observations, const Rewards& rewards,
                     const Flags& terminated, const std::optional<Flags>& active) {
  need_rows(batch, actions.shape(0), "actions");
  set_active(batch, active);
  for (std::size_t i = 0; i < batch.landers.size(); ++i) {
    if (batch.active[i] == 0) continue;
    if (std::isnan(actions(i, 0)) || std::isnan(actions(i, 1))) {
      throw nb::value_error(
          ("actions[" + std::to_string(i) + "] is not a number: must be from -1 to 1").c_str());
    }
    batch.throttles[i] = continuous_throttle(actions(i, 0), actions(i, 1));
  }
  step_batch(batch, observations, rewards, terminated);
}

void reset_one(Batch& batch, std::int64_t index, const std::optional<nb::int_>& seed_given,
               const Array<float, nb::shape<kObservationSize>>& observation) {
  Lander& lander = lander_at(batch, index);
  seed_or_go_on(lander, seed_given);
  const Observation first = reset(lander);
  std::memcpy(observation.data(), first.data(), sizeof(first));
}

nb::bytes snapshot_one(Batch& batch, std::int64_t index) {
  const auto bytes = snapshot(lander_at(batch, index));
  return nb::bytes(bytes.data(), bytes.size());
}

void restore_one(Batch& batch, std::int64_t index, const nb::bytes& bytes) {
  Lander& lander = lander_at(batch, index);
  lander = restored({static_cast<const std::byte*>(bytes.data()), bytes.size()}, lander.config);
}

void copy_to(Batch& batch, std::int64_t from, const std::vector<std::int64_t>& to) {
  const Lander source = lander_at(batch, from);
  for (const std::int64_t index : to) lander_at(batch, index) = source;
}

void read_states(const Batch& batch, const States& states) {
  need_rows(batch, states.shape(0), "states");
  for (std::size_t i = 0; i < batch.landers.size(); ++i) {
    for (std::size_t j = 0; j < kNumBodies; ++j) {
      const Body& body = batch.landers[i].world.bodies[j];
      const float row[6] = {body.transform.origin.x, body.transform.origin.y, body.sweep.angle,
                            body.velocity.x,         body.velocity.y,         body.spin};
      std::memcpy(&states(i, j, 0), row, sizeof(row));
    }
  }
}

}  // namespace

void bind_batch(nb::module_& m) {
  nb::class_<Batch>(m, "Batch",
                    "Landers stepped together, in SIMD lanes; each flies as it would alone.")
      .def(
          "__init__",
          [](Batch* batch, std::int64_t num_envs, bool continuous, double gravity,
             bool enable_wind, double wind_power, double turbulence_power) {
            if (num_envs < 1) {
              throw nb::value_error(
                  ("num_envs = " + std::to_string(num_envs) + ": must be at least 1").c_str());
            }
            new (batch) Batch(static_cast<std::size_t>(num_envs),
                              checked_config(continuous, gravity, enable_wind, wind_power,
                                             turbulence_power));
          },
          "num_envs"_a, nb::kw_only(), "continuous"_a = false, "gravity"_a = -10.0,
          "enable_wind"_a = false, "wind_power"_a = 15.0, "turbulence_power"_a = 1.5)
      .def("__len__", [](const Batch& batch) { return batch.landers.size(); })
      .def("reset", &reset_one, "index"_a, "seed"_a.none(), "observation"_a.noconvert(),
           "Starts an episode of one lander; without a seed its stream goes on.")
      .def("step", &step_discrete, "actions"_a.noconvert(), "observations"_a.noconvert(),
           "rewards"_a.noconvert(), "terminated"_a.noconvert(), "active"_a.noconvert() = nb::none(),
           "Steps all landers, or the active ones, and writes what came of it in place.")
      .def("step", &step_continuous, "actions"_a.noconvert(), "observations"_a.noconvert(),
           "rewards"_a.noconvert(), "terminated"_a.noconvert(), "active"_a.noconvert() = nb::none())
      .def("snapshot", &snapshot_one, "index"_a, "The whole state of one lander as bytes.")
      .def("restore", &restore_one, "index"_a, "snapshot"_a,
           "Takes one lander's state from bytes; ValueError if they are not one of these settings.")
      .def("copy", &copy_to, "index"_a, "to"_a, "Copies one lander's state to others.")
      .def("states", &read_states, "out"_a.noconvert(),
           "Writes x, y, angle, their rates, for hull, leg 0 and leg 1: [N, 3, 6].");
  m.def("simd", [] { return std::string(kernel().name); },
        "The instruction set that batches are computed with.");
}

}  // namespace touchdown
