#include "train/rollout.hpp"

#include <algorithm>
#include <cmath>

#include "engine/lander.hpp"
#include "fused/kernel.hpp"
#include "train/greedy.hpp"

namespace touchdown::train {

std::int64_t Rollout::advance(const Environments& environments, const Episodes& episodes,
                              std::span<const std::int64_t> flying, const float* params,
                              std::int64_t max_steps) {
  if (network_.noisy) {
    weights_.resize(static_cast<std::size_t>(network_.num_weights));
    fused::kernel().sample_weights(network_, params, nullptr, weights_.data());
    params = weights_.data();
  }
  for (std::int64_t step = 0; step < max_steps; ++step) {
    if (!act(environments, episodes, flying, params)) return step;
    engine::step(environments.landers, environments.throttles, environments.tasks,
                 environments.results, environments.workspaces, environments.workers);
    bool ended = false;
    for (const std::int64_t index : flying) {
      const auto i = static_cast<std::size_t>(index);
      ++environments.steps[i];
      record_step(environments, episodes, i);
      ended |= environments.results.terminated[i] || environments.steps[i] >= max_episode_steps_;
    }
    if (ended) return step + 1;
  }
  return max_steps;
}

bool Rollout::act(const Environments& environments, const Episodes& episodes,
                  std::span<const std::int64_t> flying, const float* params) {
  const std::size_t size = engine::kObservationSize;
  const auto num_actions = static_cast<std::size_t>(network_.num_actions);
  observations_.resize(flying.size() * size);
  q_.resize(flying.size() * num_actions);
  for (std::size_t row = 0; row < flying.size(); ++row) {
    const auto i = static_cast<std::size_t>(flying[row]);
    std::copy_n(episodes.observations + i * size, size, observations_.begin() + row * size);
  }
  const fused::NetworkKernel& kernel = fused::kernel();
  kernel.values(network_, params, observations_.data(), static_cast<std::ptrdiff_t>(flying.size()),
                block_.of_size(kernel.values_workspace(network_)), q_.data());
  if (!std::all_of(q_.begin(), q_.end(), [](float value) { return std::isfinite(value); })) {
    return false;
  }
  for (std::size_t row = 0; row < flying.size(); ++row) {
    const auto i = static_cast<std::size_t>(flying[row]);
    const std::int64_t action = greedy_action(q_.data() + row * num_actions, network_.num_actions);
    environments.actions[i] = action;
    environments.throttles[i] = engine::discrete_throttle(static_cast<int>(action));
  }
  return true;
}

}  // namespace touchdown::train
