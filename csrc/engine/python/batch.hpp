// The Python class `Batch`: its landers, and a step of them with all arguments checked.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/batch.hpp"
#include "engine/lander.hpp"
#include "engine/python/arguments.hpp"

namespace touchdown::engine {

template <typename T, typename... Shape>
using Array = nb::ndarray<T, nb::numpy, nb::device::cpu, nb::c_contig, Shape...>;
template <typename T>
using Vector = Array<T, nb::shape<-1>>;
using Observations = Array<float, nb::shape<-1, kObservationSize>>;
using DiscreteActions = Vector<const std::int64_t>;
using ContinuousActions = Array<const float, nb::shape<-1, 2>>;

inline constexpr std::size_t kMaxThreads = 1024;  // more is surely a typing error

// Landers that are stepped together, and what a step needs: the Python class `Batch`.
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
  bool stepping = false;  // changes only under Python's lock, which a step releases
};

// Marks a batch as stepping while it lives. It is made before Python's lock is released.
class Stepping {
 public:
  explicit Stepping(Batch& batch) : batch_(batch) { batch_.stepping = true; }
  ~Stepping() { batch_.stepping = false; }
  Stepping(const Stepping&) = delete;
  Stepping& operator=(const Stepping&) = delete;

 private:
  Batch& batch_;
};

inline void need_idle(const Batch& batch) {
  if (batch.stepping) throw std::runtime_error("another thread is stepping these landers");
}

[[noreturn]] inline void refuse(const std::string& complaint) {
  throw nb::value_error(complaint.c_str());
}

inline void need_rows(const Batch& batch, std::size_t rows, const char* name) {
  if (rows == batch.landers.size()) return;
  refuse(std::string(name) + " has " + std::to_string(rows) + " rows, must have " +
         std::to_string(batch.landers.size()));
}

inline std::size_t need_positive(std::int64_t value, const char* name) {
  if (value < 1) refuse(std::string(name) + " = " + std::to_string(value) + ": must be at least 1");
  return static_cast<std::size_t>(value);
}

inline Lander& lander_at(Batch& batch, std::int64_t index) {
  need_idle(batch);
  if (index < 0 || index >= static_cast<std::int64_t>(batch.landers.size())) {
    throw nb::index_error(("index " + std::to_string(index) + ": must be from 0 to " +
                           std::to_string(batch.landers.size() - 1))
                              .c_str());
  }
  return batch.landers[static_cast<std::size_t>(index)];
}

inline void set_tasks(Batch& batch, const std::optional<Vector<const std::uint8_t>>& tasks) {
  if (!tasks) {
    std::fill(batch.tasks.begin(), batch.tasks.end(), Task::kStep);
    return;
  }
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

inline Throttle throttle_of(const DiscreteActions& actions, std::size_t i) {
  const std::int64_t action = actions(i);
  if (action < 0 || action >= kNumActions) {
    refuse("actions[" + std::to_string(i) + "] = " + std::to_string(action) +
           ": must be a whole number from 0 to 3");
  }
  return discrete_throttle(static_cast<int>(action));
}

inline Throttle throttle_of(const ContinuousActions& actions, std::size_t i) {
  if (std::isnan(actions(i, 0)) || std::isnan(actions(i, 1))) {
    refuse("actions[" + std::to_string(i) + "] is not a number: must be from -1 to 1");
  }
  return continuous_throttle(actions(i, 0), actions(i, 1));
}

constexpr bool is_continuous(const DiscreteActions*) { return false; }
constexpr bool is_continuous(const ContinuousActions*) { return true; }

// Carries out the tasks of a batch. Everything is checked before anything moves.
template <typename Actions>
void carry_out(Batch& batch, const Actions& actions, const Observations& observations,
               const Vector<double>& rewards, const Vector<bool>& terminated) {
  need_rows(batch, actions.shape(0), "actions");
  need_rows(batch, observations.shape(0), "observations");
  need_rows(batch, rewards.shape(0), "rewards");
  need_rows(batch, terminated.shape(0), "terminated");
  const bool continuous = batch.landers.front().config.continuous != 0;
  if (continuous != is_continuous(&actions)) {
    refuse(continuous ? "actions are whole numbers: these landers take pairs of throttles"
                      : "actions are pairs of throttles: these landers take whole numbers");
  }
  for (std::size_t i = 0; i < batch.landers.size(); ++i) {
    if (batch.tasks[i] != Task::kStep) continue;
    if (batch.landers[i].started == 0) {
      throw std::runtime_error("reset environment " + std::to_string(i) + " before its first step");
    }
    batch.throttles[i] = throttle_of(actions, i);
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

template <typename Actions>
void step_batch(Batch& batch, const Actions& actions, const Observations& observations,
                const Vector<double>& rewards, const Vector<bool>& terminated,
                const std::optional<Vector<const std::uint8_t>>& tasks) {
  need_idle(batch);
  const Stepping stepping(batch);
  set_tasks(batch, tasks);
  carry_out(batch, actions, observations, rewards, terminated);
}

// Steps every lander or, where `ended`, begins its next episode; then counts the steps. In Python,
// each of these operations on arrays takes as long as a lander's step.
template <typename Actions>
void step_episodes(Batch& batch, const Actions& actions, const Observations& observations,
                   const Vector<double>& rewards, const Vector<bool>& terminated,
                   const Vector<bool>& truncated, const Vector<std::int64_t>& steps,
                   const Vector<bool>& ended, std::int64_t limit) {
  need_idle(batch);
  const Stepping stepping(batch);
  need_rows(batch, truncated.shape(0), "truncated");
  need_rows(batch, steps.shape(0), "steps");
  need_rows(batch, ended.shape(0), "ended");
  for (std::size_t i = 0; i < batch.tasks.size(); ++i) {
    batch.tasks[i] = ended(i) ? Task::kBegin : Task::kStep;
  }
  carry_out(batch, actions, observations, rewards, terminated);
  for (std::size_t i = 0; i < batch.tasks.size(); ++i) {
    steps(i) = ended(i) ? 0 : steps(i) + 1;
    truncated(i) = steps(i) >= limit;
    ended(i) = terminated(i) || truncated(i);
  }
}

}  // namespace touchdown::engine
