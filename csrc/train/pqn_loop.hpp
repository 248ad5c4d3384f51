// The training loop of PQN in landers of the engine, with the fused kernel: act and step for a
// rollout of all environments, then fit its λ-returns (Gallici et al., 2025).
//
// Python's loop (touchdown.training.loop, touchdown.agents.pqn) is its slow twin. Both give the
// same bytes: the order of the random draws and of every operation is that of the Python loop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "fused/block.hpp"
#include "fused/learning.hpp"
#include "fused/network.hpp"
#include "train/draws.hpp"
#include "train/environments.hpp"
#include "train/interaction.hpp"
#include "train/mirror.hpp"
#include "train/settings.hpp"

namespace touchdown::train {

// T steps of N environments, as touchdown.agents.rollout has them.
struct RolloutSteps {
  float* o_tm1;         // [T][N][D]
  std::int32_t* a_tm1;  // [T][N], like all that follow, except for `o_t`
  float* r_t;
  float* o_t;         // [T][N][D]
  float* terminated;  // 1 where the episode terminated, else 0
  float* truncated;   // 1 where it was truncated and not terminated, else 0
};

// Everything that the loop reads and writes, besides its counts.
struct PqnParts {
  Environments environments;
  Episodes episodes;
  RolloutSteps rollout;
  fused::Learner learner;  // without a target
  float* average;          // [P], of the online parameters; null: none
  float* q;                // [N][A]
  const BitGenerator& exploration;
  const BitGenerator& replay;  // orders the minibatches
};

class PqnLoop {
 public:
  // With a `mirror`, each rollout has images of some environments' steps instead of the steps.
  PqnLoop(const Settings& settings, const fused::Network& network,
          std::optional<Mirror> mirror = std::nullopt)
      : settings_(settings),
        network_(network),
        mirror_(std::move(mirror)),
        interaction_(settings, network) {}

  const Settings& settings() const { return settings_; }
  const fused::Network& network() const { return network_; }

  // See `Interaction::advance`.
  //
  // Throws std::invalid_argument if a stored step has an action that the network does not.
  std::optional<fused::Metrics> advance(const PqnParts& parts, std::int64_t max_steps,
                                        Counts& counts);

 private:
  // Stores the latest step of environment `i` in the rollout.
  void store(const PqnParts& parts, std::size_t i, EpisodeEnd end, const Counts& counts) const;
  // Learns from the rollout if it is complete.
  Learnt learn(const PqnParts& parts, Counts& counts);
  // Refuses a rollout with an action that the network does not have.
  void check_actions(const PqnParts& parts) const;
  // Replaces the steps of some environments, half of them on average, by their images.
  void mirror_half(const PqnParts& parts, const Mirror& mirror);
  // Gₜ = r + γ·[λ·Gₜ₊₁ + (1 − λ)·maxₐ Q(s′,a)] of each step of a complete rollout.
  void compute_targets(const PqnParts& parts);
  // The minibatches of all epochs.
  void draw_order(const PqnParts& parts);
  fused::Metrics fit(const PqnParts& parts, Counts& counts);
  std::size_t batch_size() const;
  // The steps of a complete rollout, T·N.
  std::size_t num_stored(const PqnParts& parts) const;

  Settings settings_;
  fused::Network network_;
  std::optional<Mirror> mirror_;
  Interaction interaction_;
  std::vector<char> chosen_;         // [N], whose steps are mirrored
  std::vector<float> q_t_;           // [T·N][A]
  std::vector<float> best_;          // [T·N]
  std::vector<float> targets_;       // [T·N]
  std::vector<std::int64_t> drawn_;  // [T·N]
  std::vector<std::int64_t> order_;  // [K·B]
  std::vector<float> rates_;         // [K]
  std::vector<float> td_error_;      // [K·B]
  fused::Block block_;
};

}  // namespace touchdown::train
