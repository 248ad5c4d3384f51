// Acting in landers and stepping them: what the training loops share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/batch.hpp"
#include "fused/block.hpp"
#include "fused/learning.hpp"
#include "fused/network.hpp"
#include "fused/noise.hpp"
#include "train/draws.hpp"
#include "train/greedy.hpp"
#include "train/priorities.hpp"
#include "train/settings.hpp"

namespace touchdown::train {

// What changes from call to call and is no array. Python's objects keep it between calls.
struct Counts {
  std::int64_t env_steps = 0;     // over all environments
  std::int64_t episodes = 0;      // that have ended
  std::int64_t updates = 0;       // of the agent
  std::int64_t adam_updates = 0;  // of the optimiser
  std::int64_t added = 0;         // transitions ever stored
  std::int64_t filled = 0;        // steps of the rollout that are stored
  double epsilon = 0.0;           // of the next actions
  double epsilon_used = 0.0;      // of the latest actions
  bool knows_values = false;      // whether `q` holds the action values of the current observations
  // Whether an episode ended in the latest step: the caller resets its environment, and the updates
  // that are due after the step follow in the next call.
  bool ended = false;
  PriorityCounts priorities;
};

// What acting reads and writes.
struct Acting {
  const Environments& environments;
  const Episodes& episodes;
  const float* params;  // [P], of the online network
  float* q;             // [N][A]
  const BitGenerator& exploration;
};

// What a loop's parts have for acting.
template <typename Parts>
Acting acting_of(const Parts& parts) {
  return {.environments = parts.environments,
          .episodes = parts.episodes,
          .params = parts.learner.online,
          .q = parts.q,
          .exploration = parts.exploration};
}

// Refuses an action that the network does not have; `what` has it.
inline void check_action(std::int32_t action, int num_actions, const char* what) {
  if (action >= 0 && action < num_actions) return;
  throw std::invalid_argument(std::string(what) + " has action " + std::to_string(action) +
                              ": must be from 0 to " + std::to_string(num_actions - 1));
}

// How an episode ended in a step, as the agent learns it; both are false if it goes on.
struct EpisodeEnd {
  bool terminated = false;
  bool truncated = false;
};

// What followed a step.
struct Learnt {
  bool updated = false;
  std::int64_t updates_before = 0;
  std::optional<fused::Metrics> metrics;  // if a metrics period was completed
};

class Interaction {
 public:
  Interaction(const Settings& settings, const fused::Network& network)
      : settings_(settings), network_(network) {}

  // Learns from a step that ended an episode, if that is left to do, then takes at most `max_steps`
  // steps of all environments. It stops after a step that ended an episode, and after a step whose
  // updates completed a metrics period; then it returns the metrics of the last update.
  //
  // After each step, `store(i, end)` stores that of environment `i`, whose episode still has the
  // observation before it, and `learn()` does the updates that are due; it returns `Learnt`.
  template <typename Store, typename Learn>
  std::optional<fused::Metrics> advance(const Acting& acting, std::int64_t max_steps,
                                        Counts& counts, Store store, Learn learn) {
    Learnt learnt;
    if (counts.ended) {
      counts.ended = false;
      learnt = learn();
    }
    for (std::int64_t step = 0; step < max_steps && !learnt.metrics; ++step) {
      act(acting, learnt, counts);
      if (record(acting, counts, store) > 0) {
        counts.ended = true;
        return std::nullopt;
      }
      learnt = learn();
    }
    // The Python loop computes them after every update; in between, they are computed when needed.
    if (learnt.updated && !counts.knows_values) compute_values(acting, learnt, counts);
    return learnt.metrics;
  }

  // The action that would follow one observation [D], chosen like those of a step.
  std::int32_t action_after(const Acting& acting, const float* observation, const Counts& counts);

 private:
  // The parameters for acting: those of the online network, or a sample of noisy weights.
  const float* sampled(const float* params, std::uint32_t purpose, std::int64_t number);
  // Chooses ε-greedy actions and steps all environments with them.
  void act(const Acting& acting, const Learnt& learnt, Counts& counts);
  // The values of the current observations, with the noise that follows `learnt`.
  void compute_values(const Acting& acting, const Learnt& learnt, Counts& counts);

  // Records the step of all environments; returns how many episodes ended in it.
  template <typename Store>
  std::int64_t record(const Acting& acting, Counts& counts, Store store) const {
    const Environments& environments = acting.environments;
    const std::size_t num_envs = environments.landers.size();
    std::int64_t num_ended = 0;
    for (std::size_t i = 0; i < num_envs; ++i) {
      ++environments.steps[i];
      const bool truncated = environments.steps[i] >= settings_.max_episode_steps;
      const bool terminated = environments.results.terminated[i];
      store(i, EpisodeEnd{
                   .terminated = terminated || (truncated && !settings_.bootstrap_on_time_limit),
                   .truncated = truncated});
      record_step(environments, acting.episodes, i);
      if (terminated || truncated) ++num_ended;
    }
    counts.env_steps += static_cast<std::int64_t>(num_envs);
    counts.episodes += num_ended;
    counts.epsilon = epsilon_after(settings_, counts.episodes, counts.env_steps);
    counts.knows_values = false;
    return num_ended;
  }

  Settings settings_;
  fused::Network network_;
  std::vector<char> explores_;  // [N]
  std::vector<float> noise_;    // of a noisy network
  std::vector<float> weights_;  // that the noise gives it
  std::vector<float> alone_;    // [A], values of one observation
  fused::Block block_;
};

}  // namespace touchdown::train
