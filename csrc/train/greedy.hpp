// The greedy action, and the record of a step: what training and rollouts share.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "engine/lander.hpp"
#include "train/environments.hpp"

namespace touchdown::train {

// The first of the largest values. As in NumPy's argmax, a NaN counts as the largest.
inline std::int64_t greedy_action(const float* q, int num_actions) {
  int best = 0;
  for (int a = 1; a < num_actions && !std::isnan(q[best]); ++a) {
    if (!(q[a] <= q[best])) best = a;
  }
  return best;
}

// Adds the latest step of environment `i` to its episode.
inline void record_step(const Environments& environments, const Episodes& episodes, std::size_t i) {
  constexpr std::size_t size = engine::kObservationSize;
  std::copy_n(environments.results.observations + i * size, size, episodes.observations + i * size);
  episodes.actions[i * episodes.room + static_cast<std::size_t>(episodes.steps[i])] =
      static_cast<std::int32_t>(environments.actions[i]);
  episodes.returns[i] += environments.results.rewards[i];
  ++episodes.steps[i];
}

}  // namespace touchdown::train
