// The Python class `Rollout`, which checks all arguments before anything is written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/python/batch.hpp"
#include "fused/network.hpp"
#include "train/python/arrays.hpp"
#include "train/rollout.hpp"

namespace touchdown::train {

// While one thread steps a batch, others are refused.
class PythonRollout {
 public:
  PythonRollout(engine::Batch& batch, const fused::Network& network, std::int64_t max_episode_steps)
      : batch_(batch), rollout_(of_landers(network), max_episode_steps) {
    need_least(max_episode_steps, 1, "max_episode_steps");
    need_discrete(batch);
  }
  PythonRollout(const PythonRollout&) = delete;
  PythonRollout& operator=(const PythonRollout&) = delete;

  std::int64_t advance(std::int64_t max_steps, const Vector<const float>& params,
                       const Vector<const std::uint8_t>& tasks, const PoolArrays& pool,
                       const EpisodeArrays& episodes) {
    need_idle(batch_);
    const engine::Stepping stepping(batch_);
    need_least(max_steps, 0, "max_steps");
    need(params.shape(0), static_cast<std::size_t>(rollout_.network().num_params), "params");
    set_tasks(batch_, tasks);
    flying_.clear();
    for (std::size_t i = 0; i < batch_.tasks.size(); ++i) {
      if (batch_.tasks[i] == engine::Task::kBegin) {
        refuse("tasks[" + std::to_string(i) + "] = 2: must be 0 (nothing) or 1 (step)");
      }
      if (batch_.tasks[i] == engine::Task::kStep) flying_.push_back(static_cast<std::int64_t>(i));
    }
    check_pool(batch_, pool);
    check_episodes(batch_, episodes, pool, rollout_.max_episode_steps(),
                   episodes.observations.shape(0));
    const nb::gil_scoped_release released;
    return rollout_.advance(environments_of(batch_, pool), episodes_of(episodes), flying_,
                            params.data(), max_steps);
  }

 private:
  engine::Batch& batch_;
  Rollout rollout_;
  std::vector<std::int64_t> flying_;
};

}  // namespace touchdown::train
