// Arrays of Python's objects, and their checks.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "engine/python/batch.hpp"
#include "fused/network.hpp"
#include "train/loop.hpp"

namespace touchdown::train {

namespace nb = nanobind;

using engine::Array;
using engine::Observations;
using engine::refuse;
using engine::Vector;
template <typename T>
using Matrix = Array<T, nb::shape<-1, -1>>;

// Refuses an array whose length is not the one expected.
inline void need(std::size_t given, std::size_t wanted, const char* name) {
  if (given == wanted) return;
  refuse(std::string(name) + " has " + std::to_string(given) + " entries, must have " +
         std::to_string(wanted));
}

inline void need_least(std::int64_t given, std::int64_t least, const char* name) {
  if (given >= least) return;
  refuse(std::string(name) + " = " + std::to_string(given) + ": must be at least " +
         std::to_string(least));
}

// The arrays of a pool of environments, [N] or [N, D].
struct PoolArrays {
  Vector<std::int64_t> actions;
  Observations observations;
  Vector<double> rewards;
  Vector<bool> terminated;
  Vector<std::int64_t> steps;
};

// The arrays of the episodes underway, [N], [N, D] or [N, room].
struct EpisodeArrays {
  Observations observations;
  Vector<double> returns;
  Vector<std::int64_t> steps;
  Matrix<std::int32_t> actions;
};

inline void need_discrete(const engine::Batch& batch) {
  if (batch.landers.front().config.continuous == 0) return;
  refuse("these landers take pairs of throttles: must take whole numbers");
}

// Refuses a network that is not for landers with whole-number actions.
inline const fused::Network& of_landers(const fused::Network& network) {
  need(static_cast<std::size_t>(network.num_observations), engine::kObservationSize,
       "an observation of the network");
  need(static_cast<std::size_t>(network.num_actions), engine::kNumActions,
       "a row of the network's values");
  return network;
}

inline void check_pool(const engine::Batch& batch, const PoolArrays& pool) {
  need_rows(batch, pool.actions.shape(0), "actions");
  need_rows(batch, pool.observations.shape(0), "observations");
  need_rows(batch, pool.rewards.shape(0), "rewards");
  need_rows(batch, pool.terminated.shape(0), "terminated");
  need_rows(batch, pool.steps.shape(0), "steps");
}

// An episode has at most `most` steps, which is room enough for its actions. Environments from
// number `rows` on have no episode; their task is to do nothing.
inline void check_episodes(const engine::Batch& batch, const EpisodeArrays& episodes,
                           const PoolArrays& pool, std::int64_t most, std::size_t rows) {
  need(episodes.observations.shape(0), rows, "observations of the episodes");
  need(episodes.returns.shape(0), rows, "returns");
  need(episodes.steps.shape(0), rows, "steps of the episodes");
  need(episodes.actions.shape(0), rows, "actions of the episodes");
  need_least(static_cast<std::int64_t>(episodes.actions.shape(1)), most,
             "room for the actions of an episode");
  for (std::size_t i = 0; i < batch.landers.size(); ++i) {
    if (batch.tasks[i] == engine::Task::kNothing) continue;
    if (i >= rows) refuse("environment " + std::to_string(i) + " has no episode");
    if (episodes.steps(i) != pool.steps(i) || pool.steps(i) < 0 || pool.steps(i) >= most) {
      refuse("environment " + std::to_string(i) + " is after " + std::to_string(pool.steps(i)) +
             " steps, its episode after " + std::to_string(episodes.steps(i)) +
             ": must be the same number, from 0 to " + std::to_string(most - 1));
    }
  }
}

inline Environments environments_of(engine::Batch& batch, const PoolArrays& pool) {
  return {.landers = batch.landers,
          .throttles = batch.throttles,
          .tasks = batch.tasks,
          .workspaces = batch.workspaces,
          .workers = batch.workers,
          .actions = pool.actions.data(),
          .results = {pool.observations.data(), pool.rewards.data(), pool.terminated.data()},
          .steps = pool.steps.data()};
}

inline Episodes episodes_of(const EpisodeArrays& episodes) {
  return {.observations = episodes.observations.data(),
          .returns = episodes.returns.data(),
          .steps = episodes.steps.data(),
          .actions = episodes.actions.data(),
          .room = episodes.actions.shape(1)};
}

}  // namespace touchdown::train
