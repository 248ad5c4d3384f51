// Greedy episodes of a network in landers of the engine: act and step, without learning.
//
// Python's loop (touchdown.evaluation.evaluator) is its slow twin. Both give the same bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fused/block.hpp"
#include "fused/network.hpp"
#include "train/environments.hpp"

namespace touchdown::train {

class Rollout {
 public:
  Rollout(const fused::Network& network, std::int64_t max_episode_steps)
      : network_(network), max_episode_steps_(max_episode_steps) {}

  const fused::Network& network() const { return network_; }
  std::int64_t max_episode_steps() const { return max_episode_steps_; }

  // Takes at most `max_steps` steps of the environments in `flying`, and stops after one that ended
  // an episode. It stops before a step for which an action value is not finite. The tasks of the
  // environments say who flies too.
  //
  // Returns the number of steps.
  std::int64_t advance(const Environments& environments, const Episodes& episodes,
                       std::span<const std::int64_t> flying, const float* params,
                       std::int64_t max_steps);

 private:
  // Chooses the action of each environment in `flying`; returns whether all values are finite.
  bool act(const Environments& environments, const Episodes& episodes,
           std::span<const std::int64_t> flying, const float* params);

  fused::Network network_;
  std::int64_t max_episode_steps_;
  std::vector<float> observations_;  // of those that fly, one after the other
  std::vector<float> q_;
  std::vector<float> weights_;  // the means of noisy ones
  fused::Block block_;
};

}  // namespace touchdown::train
