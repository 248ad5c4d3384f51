#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
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
template <typename T>
using Vector = Array<T, nb::shape<-1>>;
using Observations = Array<float, nb::shape<-1, kObservationSize>>;
using DiscreteActions = Vector<const std::int64_t>;
using ContinuousActions = Array<const float, nb::shape<-1, 2>>;

constexpr std::size_t kMostThreads = 1024;  // more would be a slip of the finger

// Landers that are stepped together, and what a step needs.
struct Batch {
  Batch(std::size_t count, std::size_t num_threads, const Config& config)
      : landers(count, make_lander(config)),
        throttles(count),
        tasks(count),
        workspaces(num_threads),
        workers(num_threads) {}
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  std::vector<Lander> landers;
  std::vector<Throttle> throttles;
  std::vector<Task> tasks;
  std::vector<Workspace> workspaces;
  Workers workers;
  bool stepping = false;  // changes only under Python's lock, which a step gives back meanwhile
};

// Marks a batch for as long as it lives; to be made before Python's lock is given back.
class Stepping {
 public:
  explicit Stepping(Batch& batch) : batch_(batch) { batch_.stepping = true; }
  ~Stepping() { batch_.stepping = false; }
  Stepping(const Stepping&) = delete;
  Stepping& operator=(const Stepping&) = delete;

 private:
  Batch& batch_;
};

void need_rest(const Batch& batch) {
  if (batch.stepping) throw std::runtime_error("another thread is stepping these landers");
}

[[noreturn]] void refuse(const std::string& complaint) { throw nb::value_error(complaint.c_str()); }

void need_rows(const Batch& batch, std::size_t rows, const char* name) {
  if (rows == batch.landers.size()) return;
  refuse(std::string(name) + " has " + std::to_string(rows) + " rows, must have " +
         std::to_string(batch.landers.size()));
}

std::size_t need_positive(std::int64_t value, const char* name) {
  if (value < 1) refuse(std::string(name) + " = " + std::to_string(value) + ": must be at least 1");
  return static_cast<std::size_t>(value);
}

Lander& lander_at(Batch& batch, std::int64_t index) {
  need_rest(batch);
  if (index < 0 || index >= static_cast<std::int64_t>(batch.landers.size())) {
    throw nb::index_error(("index " + std::to_string(index) + ": must be from 0 to " +
                           std::to_string(batch.landers.size() - 1))
                              .c_str());
  }
  return batch.landers[static_cast<std::size_t>(index)];
}

void set_tasks(Batch& batch, const std::optional<Vector<const std::uint8_t>>& tasks) {
  if (!tasks) {
    std::fill(batch.tasks.begin(), batch.tasks.end(), Task::kStep);
  } else {
    need_rows(batch, tasks->shape(0), "tasks");
    for (std::size_t i = 0; i < batch.tasks.size(); ++i) {
      const std::uint8_t task = (*tasks)(i);
      if (task >= kNumTasks) {
        refuse("tasks[" + std::to_string(i) + "] = " + std::to_string(task) +
               ": must be 0 (nothing), 1 (step) or 2 (begin)");
      }
      batch.tasks[i] = static_cast<Task>(task);
    }
  }
  for (std::size_t i = 0; i < batch.landers.size(); ++i) {
    if (batch.tasks[i] == Task::kStep && batch.landers[i].started == 0) {
      throw std::runtime_error("reset environment " + std::to_string(i) +
                               " before its first step");
    }
  }
}

Throttle throttle_of(const DiscreteActions& actions, std::size_t i) {
  const std::int64_t action = actions(i);
  if (action < 0 || action >= kNumActions) {
    refuse("actions[" + std::to_string(i) + "] = " + std::to_string(action) +
           ": must be a whole number from 0 to 3");
  }
  return discrete_throttle(static_cast<int>(action));
}

Throttle throttle_of(const ContinuousActions& actions, std::size_t i) {
  if (std::isnan(actions(i, 0)) || std::isnan(actions(i, 1))) {
    refuse("actions[" + std::to_string(i) + "] is not a number: must be from -1 to 1");
  }
  return continuous_throttle(actions(i, 0), actions(i, 1));
}

constexpr bool is_continuous(const DiscreteActions*) { return false; }
constexpr bool is_continuous(const ContinuousActions*) { return true; }

template <typename Actions>
void step_batch(Batch& batch, const Actions& actions, const Observations& observations,
                const Vector<double>& rewards, const Vector<bool>& terminated,
                const std::optional<Vector<const std::uint8_t>>& tasks) {
  need_rest(batch);
  const Stepping stepping(batch);
  need_rows(batch, actions.shape(0), "actions");
  need_rows(batch, observations.shape(0), "observations");
  need_rows(batch, rewards.shape(0), "rewards");
  need_rows(batch, terminated.shape(0), "terminated");
  const bool continuous = batch.landers.front().config.continuous != 0;
  if (continuous != is_continuous(&actions)) {
    refuse(continuous ? "actions are whole numbers: these landers take pairs of throttles"
                      : "actions are pairs of throttles: these landers take whole numbers");
  }
  // All is looked at before anything moves.
  set_tasks(batch, tasks);
  for (std::size_t i = 0; i < batch.landers.size(); ++i) {
    if (batch.tasks[i] == Task::kStep) batch.throttles[i] = throttle_of(actions, i);
  }
  for (std::size_t i = 0; i < batch.landers.size(); ++i) {
    if (batch.tasks[i] == Task::kBegin && batch.landers[i].seeded == 0) {
      seed(batch.landers[i], entropy_of_the_system());
    }
  }
  const Results results{observations.data(), rewards.data(), terminated.data()};
  const nb::gil_scoped_release released;
  step(batch.landers, batch.throttles, batch.tasks, results, batch.workspaces, batch.workers);
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
  for (const std::int64_t index : to) lander_at(batch, index);
  for (const std::int64_t index : to) lander_at(batch, index) = source;
}

constexpr std::size_t kBodyFloats = 6;

void read_states(const Batch& batch, const Array<float, nb::shape<-1, kNumBodies, 6>>& bodies,
                 const Array<bool, nb::shape<-1, kNumLegs>>& leg_contacts,
                 const Vector<bool>& awake, const Array<double, nb::shape<-1, 3>>& engines) {
  need_rest(batch);
  need_rows(batch, bodies.shape(0), "bodies");
  need_rows(batch, leg_contacts.shape(0), "leg_contacts");
  need_rows(batch, awake.shape(0), "awake");
  need_rows(batch, engines.shape(0), "engines");
  for (std::size_t i = 0; i < batch.landers.size(); ++i) {
    const Lander& lander = batch.landers[i];
    for (std::size_t j = 0; j < kNumBodies; ++j) {
      const Body& body = lander.world.bodies[j];
      const std::array<float, kBodyFloats> row{
          body.transform.origin.x, body.transform.origin.y, body.sweep.angle,
          body.velocity.x,         body.velocity.y,         body.spin};
      std::copy(row.begin(), row.end(), &bodies(i, j, 0));
    }
    for (std::size_t j = 0; j < kNumLegs; ++j) {
      leg_contacts(i, j) = lander.world.touches.legs[j] != 0;
    }
    awake(i) = lander.world.bodies[kHull].awake != 0;
    engines(i, 0) = lander.throttle.main;
    engines(i, 1) = lander.throttle.side * lander.throttle.direction;
    engines(i, 2) = lander.fuel;
  }
}

void read_terrain(Batch& batch, std::int64_t index,
                  const Array<double, nb::shape<kNumHeights, 2>>& points) {
  const Lander& lander = lander_at(batch, index);
  for (std::size_t i = 0; i < kNumHeights; ++i) {
    points(i, 0) = kChunk * static_cast<double>(i);
    points(i, 1) = lander.world.terrain.heights[i];
  }
}

template <std::size_t N>
nb::tuple counts(const std::array<std::uint64_t, N>& values) {
  nb::list list;
  for (const std::uint64_t value : values) list.append(value);
  return nb::tuple(list);
}

nb::dict coverage_of(const Batch& batch) {
  need_rest(batch);
  Coverage c{};
  for (const Workspace& workspace : batch.workspaces) c += workspace.coverage;
  nb::dict d;
  d["steps"] = c.steps;
  d["steps_with_impacts"] = counts(c.steps_with_impacts);
  d["steps_with_contacts"] = counts(c.steps_with_contacts);
  d["impacts_undone"] = c.impacts_undone;
  d["all_position_iterations"] = c.all_position_iterations;
  d["one_point_manifolds"] = c.one_point_manifolds;
  d["two_point_manifolds"] = c.two_point_manifolds;
  d["redundant_points"] = c.redundant_points;
  d["block_cases"] = counts(c.block_cases);
  d["limit_switches"] = c.limit_switches;
  d["fell_asleep"] = c.fell_asleep;
  d["woke_up"] = c.woke_up;
  d["one_leg_steps"] = c.one_leg_steps;
  d["most_pairs"] = c.most_pairs;
  return d;
}

}  // namespace

NB_MODULE(_engine, m) {
  m.doc() = "LunarLander-v3, bit for bit as stock Gymnasium computes it.";
  nb::class_<Pcg64>(m, "Pcg64", "NumPy's default generator, as the lander draws from it.")
      .def(
          "__init__",
          [](Pcg64* rng, const nb::int_& seed) { new (rng) Pcg64(Pcg64::seeded(entropy(seed))); },
          "seed"_a)
      .def("uniform", &Pcg64::uniform, "low"_a, "high"_a)
      .def("integers", &Pcg64::integers, "low"_a, "high"_a, "A whole number in [low, high).");

  nb::class_<Batch>(m, "Batch",
                    "Landers stepped together, in SIMD lanes; each flies as it would alone.")
      .def(
          "__init__",
          [](Batch* batch, std::int64_t num_envs, std::int64_t num_threads, bool continuous,
             double gravity, bool enable_wind, double wind_power, double turbulence_power) {
            const std::size_t count = need_positive(num_envs, "num_envs");
            const std::size_t threads = need_positive(num_threads, "num_threads");
            if (threads > kMostThreads) {
              refuse("num_threads = " + std::to_string(threads) + ": must be at most " +
                     std::to_string(kMostThreads));
            }
            new (batch) Batch(
                count, threads,
                checked_config(continuous, gravity, enable_wind, wind_power, turbulence_power));
          },
          "num_envs"_a, nb::kw_only(), "num_threads"_a = 1, "continuous"_a = false,
          "gravity"_a = -10.0, "enable_wind"_a = false, "wind_power"_a = 15.0,
          "turbulence_power"_a = 1.5)
      .def("__len__", [](const Batch& batch) { return batch.landers.size(); })
      .def(
          "seed",
          [](Batch& batch, std::int64_t index, const nb::int_& seed_given) {
            const auto words = entropy(seed_given);
            seed(lander_at(batch, index), words);
          },
          "index"_a, "seed"_a, "Starts one lander's stream of random numbers anew.")
      .def("step", &step_batch<DiscreteActions>, "actions"_a.noconvert(),
           "observations"_a.noconvert(), "rewards"_a.noconvert(), "terminated"_a.noconvert(),
           "tasks"_a.noconvert() = nb::none(),
           "Writes in place what comes of each lander's task: 0 nothing, 1 a step, 2 a new episode.")
      .def("step", &step_batch<ContinuousActions>, "actions"_a.noconvert(),
           "observations"_a.noconvert(), "rewards"_a.noconvert(), "terminated"_a.noconvert(),
           "tasks"_a.noconvert() = nb::none())
      .def("snapshot", &snapshot_one, "index"_a, "The whole state of one lander as bytes.")
      .def("restore", &restore_one, "index"_a, "snapshot"_a,
           "Takes one lander's state from bytes; ValueError if they are not one of these settings.")
      .def("copy", &copy_to, "index"_a, "to"_a, "Copies one lander's state to others.")
      .def("states", &read_states, "bodies"_a.noconvert(), "leg_contacts"_a.noconvert(),
           "awake"_a.noconvert(), "engines"_a.noconvert(),
           "Writes x, y, angle and their rates of hull, leg 0 and leg 1 [N, 3, 6], what stock says "
           "of the legs [N, 2], whether the hull is awake [N], and the last step's main and side "
           "throttle with the episode's fuel [N, 3].")
      .def("terrain", &read_terrain, "index"_a, "points"_a.noconvert(),
           "Writes the points of one lander's surface from left to right, metres, [11, 2].")
      .def("coverage", &coverage_of, "Counts of the rare paths taken since the batch was made.");

  m.def("simd", [] { return std::string(kernel().name); },
        "The instruction set that landers are computed with.");
  m.attr("HELIPAD") = nb::make_tuple(kHelipadLeft, kHelipadRight, kHelipadHeight);
}

}  // namespace touchdown
