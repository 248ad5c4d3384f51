// The settings of a training loop, and what follows from them at a time: ε and the learning rate.
//
// Python's twins are touchdown.agents.exploration and touchdown.agents.learners.fused; both compute
// in double precision, with the same operations in the same order.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "fused/learning.hpp"
#include "train/priorities.hpp"

namespace touchdown::train {

enum class Schedule { kConstant, kLinear, kExponential };

// What samples of noisy weights are for, as in touchdown.agents.learners.purposes.
inline constexpr std::uint32_t kUpdates = 1'000'001, kNextValues = 1'000'002, kActing = 1'000'003;

// The settings of PQN alone, with the names of touchdown.config.sections.
struct RolloutSettings {
  std::int64_t rollout_steps = 1;  // T
  std::int64_t epochs = 1;
  std::int64_t minibatches = 1;  // in an epoch
  double trace_decay = 0.0;      // λ
};

// The names are those of touchdown.config.sections.
struct Settings {
  Schedule schedule = Schedule::kConstant;
  double epsilon_start = 1.0;
  double epsilon_end = 0.0;
  double epsilon_decay = 1.0;         // per episode
  std::int64_t epsilon_duration = 1;  // environment steps
  std::int64_t min_size = 1;          // transitions
  std::int64_t resaves = 0;           // extra copies of a rewarded transition
  double resave_threshold = 0.0;      // a reward above it makes a transition rewarded
  double gamma = 1.0;
  std::int64_t n_step = 1;              // rewards in a transition
  bool bootstrap_on_time_limit = true;  // false: the time limit ends an episode as terminal
  double learning_rate = 0.0;
  double learning_rate_end = 0.0;
  std::int64_t learning_rate_duration = 0;  // updates; 0: the learning rate is constant
  std::int64_t batch_size = 1;
  std::int64_t update_period = 1;   // environment steps
  std::int64_t gradient_steps = 1;  // updates each time they are due
  std::int64_t target_period = 0;   // environment steps; 0: the target network is never copied
  double averaging = 0.0;           // the rate of the average of the weights; 0: there is none
  std::int64_t metrics_period = 1;  // updates
  std::int64_t max_episode_steps = 1;
  std::uint32_t seed = 0;  // of the run; of noisy weights
  bool prioritized = false;
  PrioritySettings priorities;
  fused::Rule rule;
  RolloutSettings rollout;
};

// How many multiples of `period` a count passes from `before` to `after`.
inline std::int64_t periods_crossed(std::int64_t before, std::int64_t after, std::int64_t period) {
  return after / period - before / period;
}

// ε after that many episodes have ended and that many environment steps.
inline double epsilon_after(const Settings& settings, std::int64_t episodes,
                            std::int64_t env_steps) {
  const double start = settings.epsilon_start, end = settings.epsilon_end;
  switch (settings.schedule) {
    case Schedule::kLinear: {
      const double share =
          static_cast<double>(env_steps) / static_cast<double>(settings.epsilon_duration);
      return end + (start - end) * std::max(0.0, 1.0 - share);
    }
    case Schedule::kExponential:
      return std::max(end, start * std::pow(settings.epsilon_decay, static_cast<double>(episodes)));
    case Schedule::kConstant:
      break;
  }
  return start;
}

// The learning rate of the update that `updates` came before.
inline float learning_rate_after(const Settings& settings, std::int64_t updates) {
  if (settings.learning_rate_duration == 0) return static_cast<float>(settings.learning_rate);
  const double left =
      1.0 - static_cast<double>(std::min(updates, settings.learning_rate_duration)) /
                static_cast<double>(settings.learning_rate_duration);
  const double fall = settings.learning_rate - settings.learning_rate_end;
  return static_cast<float>(settings.learning_rate_end + fall * left);
}

// The learning rates of `count` updates, the first of which `updates` came before.
inline void learning_rates_after(const Settings& settings, std::int64_t updates, std::size_t count,
                                 std::vector<float>& rates) {
  rates.resize(count);
  for (float& rate : rates) rate = learning_rate_after(settings, updates++);
}

}  // namespace touchdown::train
