// The Python class `Loop`, which checks all arguments before anything is written.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "engine/python/batch.hpp"
#include "fused/network.hpp"
#include "fused/transition.hpp"
#include "train/loop.hpp"
#include "train/python/arrays.hpp"

namespace touchdown::train {

using MetricsTuple = std::tuple<float, float, float, float>;
using MirrorTuple =
    std::tuple<std::vector<std::int64_t>, std::vector<float>, std::vector<std::int64_t>>;

inline Settings checked(const Settings& settings) {
  need_least(settings.epsilon_duration, 1, "epsilon_duration");
  need_least(settings.min_size, 1, "min_size");
  need_least(settings.n_step, 1, "n_step");
  need_least(settings.resaves, 0, "resaves");
  need_least(settings.learning_rate_duration, 0, "learning_rate_duration");
  need_least(settings.batch_size, 1, "batch_size");
  if (settings.batch_size > fused::kMaxSize) {
    refuse("batch_size = " + std::to_string(settings.batch_size) + ": must be at most " +
           std::to_string(fused::kMaxSize));
  }
  need_least(settings.update_period, 1, "update_period");
  need_least(settings.gradient_steps, 1, "gradient_steps");
  need_least(settings.target_period, 0, "target_period");
  need_least(settings.metrics_period, 1, "metrics_period");
  need_least(settings.max_episode_steps, 1, "max_episode_steps");
  need_least(settings.priorities.beta_duration, 1, "beta_duration");
  need_least(settings.rollout.rollout_steps, 1, "rollout_steps");
  need_least(settings.rollout.epochs, 1, "epochs");
  need_least(settings.rollout.minibatches, 1, "minibatches");
  return settings;
}

// The numbers of a permutation of 0 to `size` - 1.
template <typename T>
std::vector<T> permutation(const std::vector<std::int64_t>& given, int size, const char* name) {
  need(given.size(), static_cast<std::size_t>(size), name);
  std::vector<std::int64_t> sorted = given;
  std::sort(sorted.begin(), sorted.end());
  for (int i = 0; i < size; ++i) {
    if (sorted[static_cast<std::size_t>(i)] != i) {
      refuse(std::string(name) + " must have each number from 0 to " + std::to_string(size - 1) +
             " once");
    }
  }
  return {given.begin(), given.end()};
}

inline std::optional<Mirror> checked(const std::optional<MirrorTuple>& mirror) {
  if (!mirror) return std::nullopt;
  const auto& [order, signs, actions] = *mirror;
  need(signs.size(), engine::kObservationSize, "signs of the mirror");
  return Mirror{permutation<std::size_t>(order, engine::kObservationSize, "order of the mirror"),
                signs,
                permutation<std::int32_t>(actions, engine::kNumActions, "actions of the mirror")};
}

inline BitGenerator generator_of(const nb::object& bit_generator) {
  const nb::object capsule = bit_generator.attr("capsule");
  void* const found = PyCapsule_GetPointer(capsule.ptr(), "BitGenerator");
  if (found == nullptr) nb::raise_python_error();
  return *static_cast<const BitGenerator*>(found);
}

// The arrays of unfinished n-step returns, [N, n, D], [N, n] or [N].
struct WindowArrays {
  Array<float, nb::shape<-1, -1, engine::kObservationSize>> o_tm1;
  Matrix<std::int32_t> a_tm1;
  Matrix<double> r_t;
  Vector<std::int64_t> lengths;
};

// The arrays of a learner, [P].
struct LearnerArrays {
  Vector<float> online;
  std::optional<Vector<float>> target;
  Vector<float> mu;
  Vector<float> nu;
  std::optional<Vector<float>> average;
};

inline void check_counts(const Counts& counts) {
  need_least(counts.env_steps, 0, "env_steps");
  need_least(counts.episodes, 0, "episodes");
  need_least(counts.updates, 0, "updates");
  need_least(counts.adam_updates, 0, "adam_updates");
  need_least(counts.added, 0, "added");
}

inline void check_learner(const LearnerArrays& learner, const fused::Network& network) {
  const auto size = static_cast<std::size_t>(network.num_params);
  need(learner.online.shape(0), size, "online");
  if (learner.target) need(learner.target->shape(0), size, "target");
  need(learner.mu.shape(0), size, "mu");
  need(learner.nu.shape(0), size, "nu");
  if (learner.average) need(learner.average->shape(0), size, "average");
}

// Checks what the loops have in common, and that the batch is at rest.
inline void check_shared(engine::Batch& batch, const Settings& settings, std::int64_t max_steps,
                         const Counts& counts, const PoolArrays& pool,
                         const EpisodeArrays& episodes) {
  need_least(max_steps, 0, "max_steps");
  set_tasks(batch, std::nullopt);
  check_counts(counts);
  check_pool(batch, pool);
  check_episodes(batch, episodes, pool, settings.max_episode_steps, batch.landers.size());
}

inline fused::Learner learner_of(const LearnerArrays& arrays) {
  return {.online = arrays.online.data(),
          .target = arrays.target ? arrays.target->data() : nullptr,
          .mu = arrays.mu.data(),
          .nu = arrays.nu.data()};
}

inline float* average_of(const LearnerArrays& arrays) {
  return arrays.average ? arrays.average->data() : nullptr;
}

inline void need_average(const LearnerArrays& learner, const Settings& settings) {
  if (settings.averaging > 0.0 && !learner.average) refuse("average = None: must be given");
}

inline void check_values(const engine::Batch& batch, const Matrix<float>& q) {
  need_rows(batch, q.shape(0), "q");
  need(q.shape(1), static_cast<std::size_t>(engine::kNumActions), "a row of q");
}

inline std::optional<MetricsTuple> as_tuple(const std::optional<fused::Metrics>& metrics) {
  if (!metrics) return std::nullopt;
  return MetricsTuple{metrics->loss, metrics->mean_q, metrics->max_q, metrics->gradient_norm};
}

// The Python class `Loop`. While one thread steps a batch, others are refused.
class PythonLoop {
 public:
  PythonLoop(engine::Batch& batch, const nb::object& exploration, const nb::object& replay,
             const Settings& settings, const fused::Network& network,
             const std::optional<MirrorTuple>& mirror)
      : batch_(batch),
        exploration_(generator_of(exploration)),
        replay_(generator_of(replay)),
        loop_(checked(settings), of_landers(network), checked(mirror)) {
    need_discrete(batch);
  }
  PythonLoop(const PythonLoop&) = delete;
  PythonLoop& operator=(const PythonLoop&) = delete;

  std::optional<MetricsTuple> advance(std::int64_t max_steps, Counts& counts,
                                      const PoolArrays& pool, const EpisodeArrays& episodes,
                                      const WindowArrays& windows, const Matrix<float>& records,
                                      const std::optional<Vector<double>>& priorities,
                                      const LearnerArrays& learner, const Matrix<float>& q) {
    need_idle(batch_);
    const engine::Stepping stepping(batch_);
    check_shared(batch_, loop_.settings(), max_steps, counts, pool, episodes);
    check(windows);
    check(learner);
    check_values(batch_, q);
    need(records.shape(1), fused::transition_fields(engine::kObservationSize).size, "a transition");
    if (records.shape(0) < 1 || records.shape(0) > kMostRecords) {
      refuse("records has " + std::to_string(records.shape(0)) + " rows, must have from 1 to " +
             std::to_string(kMostRecords));
    }
    const std::size_t first_leaf = std::bit_ceil(records.shape(0));
    if (loop_.settings().prioritized) {
      if (!priorities) refuse("priorities = None: must be given");
      need(priorities->shape(0), 2 * first_leaf, "priorities");
    }
    const Parts parts{.environments = environments_of(batch_, pool),
                      .episodes = episodes_of(episodes),
                      .windows = {.o_tm1 = windows.o_tm1.data(),
                                  .a_tm1 = windows.a_tm1.data(),
                                  .r_t = windows.r_t.data(),
                                  .lengths = windows.lengths.data()},
                      .memory = {.records = records.data(),
                                 .capacity = static_cast<std::int64_t>(records.shape(0)),
                                 .num_observations = engine::kObservationSize},
                      .priorities = {.nodes = priorities ? priorities->data() : nullptr,
                                     .first_leaf = first_leaf},
                      .learner = learner_of(learner),
                      .average = average_of(learner),
                      .q = q.data(),
                      .exploration = exploration_,
                      .replay = replay_};
    const nb::gil_scoped_release released;
    return as_tuple(loop_.advance(parts, max_steps, counts));
  }

 private:
  static constexpr std::size_t kMostRecords = 0xffffffff;  // drawn from in 32 bits

  void check(const WindowArrays& windows) const {
    need_rows(batch_, windows.o_tm1.shape(0), "o_tm1 of the windows");
    need_rows(batch_, windows.a_tm1.shape(0), "a_tm1 of the windows");
    need_rows(batch_, windows.r_t.shape(0), "r_t of the windows");
    need_rows(batch_, windows.lengths.shape(0), "lengths of the windows");
    const std::int64_t n = loop_.settings().n_step;
    need(windows.o_tm1.shape(1), static_cast<std::size_t>(n), "o_tm1 of a window");
    need(windows.a_tm1.shape(1), static_cast<std::size_t>(n), "a_tm1 of a window");
    need(windows.r_t.shape(1), static_cast<std::size_t>(n), "r_t of a window");
    const std::int64_t most = loop_.settings().rule.sarsa ? n : n - 1;
    for (std::size_t i = 0; i < batch_.landers.size(); ++i) {
      const std::int64_t length = windows.lengths(i);
      if (length < 0 || length > most) {
        refuse("the window of environment " + std::to_string(i) + " holds " +
               std::to_string(length) + " steps: must be from 0 to " + std::to_string(most));
      }
      for (std::int64_t k = 0; k < length; ++k) {
        const std::int32_t action = windows.a_tm1(i, static_cast<std::size_t>(k));
        if (action >= 0 && action < engine::kNumActions) continue;
        refuse("the window of environment " + std::to_string(i) + " holds action " +
               std::to_string(action) + ": must be from 0 to " +
               std::to_string(engine::kNumActions - 1));
      }
    }
  }

  void check(const LearnerArrays& learner) const {
    check_learner(learner, loop_.network());
    const Settings& settings = loop_.settings();
    const bool needs_target =
        settings.rule.double_q || settings.rule.polyak > 0.0f || settings.target_period > 0;
    if (needs_target && !learner.target) refuse("target = None: must be given");
    need_average(learner, settings);
  }

  engine::Batch& batch_;
  BitGenerator exploration_;
  BitGenerator replay_;
  Loop loop_;
};

}  // namespace touchdown::train
