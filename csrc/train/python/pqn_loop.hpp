// The Python class `PqnLoop`, which checks all arguments before anything is written.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "engine/python/batch.hpp"
#include "fused/network.hpp"
#include "train/pqn_loop.hpp"
#include "train/python/arrays.hpp"
#include "train/python/loop.hpp"

namespace touchdown::train {

// The arrays of a rollout, [T, N, D] or [T, N].
struct RolloutArrays {
  Array<float, nb::shape<-1, -1, engine::kObservationSize>> o_tm1;
  Matrix<std::int32_t> a_tm1;
  Matrix<float> r_t;
  Array<float, nb::shape<-1, -1, engine::kObservationSize>> o_t;
  Matrix<float> terminated;
  Matrix<float> truncated;
};

// The Python class `PqnLoop`. While one thread steps a batch, others are refused.
class PythonPqnLoop {
 public:
  PythonPqnLoop(engine::Batch& batch, const nb::object& exploration, const nb::object& replay,
                const Settings& settings, const fused::Network& network,
                const std::optional<MirrorTuple>& mirror)
      : batch_(batch),
        exploration_(generator_of(exploration)),
        replay_(generator_of(replay)),
        loop_(checked(settings), of_landers(network), checked(mirror)) {
    if (network.prediction.kind != fused::Prediction::kMean) {
      refuse("a network that predicts quantiles or atoms: must predict values");
    }
    if (network.noisy) refuse("a noisy network: must have no noise");
    need_discrete(batch);
    const RolloutSettings& rollout = settings.rollout;
    const auto num_envs = static_cast<std::int64_t>(batch.landers.size());
    if (rollout.rollout_steps > std::numeric_limits<std::int32_t>::max() / num_envs) {
      refuse("rollout_steps = " + std::to_string(rollout.rollout_steps) + ": must be at most " +
             std::to_string(std::numeric_limits<std::int32_t>::max() / num_envs));
    }
    const std::int64_t size = rollout.rollout_steps * num_envs;
    if (rollout.minibatches > size || size / rollout.minibatches > fused::kMaxSize) {
      refuse("minibatches = " + std::to_string(rollout.minibatches) + " of " +
             std::to_string(size) + " steps: must have from 1 to " +
             std::to_string(fused::kMaxSize) + " each");
    }
  }
  PythonPqnLoop(const PythonPqnLoop&) = delete;
  PythonPqnLoop& operator=(const PythonPqnLoop&) = delete;

  std::optional<MetricsTuple> advance(std::int64_t max_steps, Counts& counts,
                                      const PoolArrays& pool, const EpisodeArrays& episodes,
                                      const RolloutArrays& rollout, const LearnerArrays& learner,
                                      const Matrix<float>& q) {
    need_idle(batch_);
    const engine::Stepping stepping(batch_);
    check_shared(batch_, loop_.settings(), max_steps, counts, pool, episodes);
    const std::int64_t num_steps = loop_.settings().rollout.rollout_steps;
    if (counts.filled < 0 || counts.filled >= num_steps) {
      refuse("filled = " + std::to_string(counts.filled) + ": must be from 0 to " +
             std::to_string(num_steps - 1));
    }
    check_part(rollout.o_tm1, "o_tm1 of the rollout");
    check_part(rollout.a_tm1, "a_tm1 of the rollout");
    check_part(rollout.r_t, "r_t of the rollout");
    check_part(rollout.o_t, "o_t of the rollout");
    check_part(rollout.terminated, "terminated of the rollout");
    check_part(rollout.truncated, "truncated of the rollout");
    check_learner(learner, loop_.network());
    need_average(learner, loop_.settings());
    check_values(batch_, q);
    const PqnParts parts{.environments = environments_of(batch_, pool),
                         .episodes = episodes_of(episodes),
                         .rollout = {.o_tm1 = rollout.o_tm1.data(),
                                     .a_tm1 = rollout.a_tm1.data(),
                                     .r_t = rollout.r_t.data(),
                                     .o_t = rollout.o_t.data(),
                                     .terminated = rollout.terminated.data(),
                                     .truncated = rollout.truncated.data()},
                         .learner = learner_of(learner),
                         .average = average_of(learner),
                         .q = q.data(),
                         .exploration = exploration_,
                         .replay = replay_};
    const nb::gil_scoped_release released;
    return as_tuple(loop_.advance(parts, max_steps, counts));
  }

 private:
  template <typename Part>
  void check_part(const Part& part, const char* name) const {
    need(part.shape(0), static_cast<std::size_t>(loop_.settings().rollout.rollout_steps), name);
    need_rows(batch_, part.shape(1), name);
  }

  engine::Batch& batch_;
  BitGenerator exploration_;
  BitGenerator replay_;
  PqnLoop loop_;
};

}  // namespace touchdown::train
