// The training loop of DQN in landers of the engine, with the fused kernel: act, step, store,
// learn.
//
// Python's loop (touchdown.training.loop, touchdown.agents.dqn) is its slow twin. Both give the
// same bytes: the order of the random draws and of every operation is that of the Python loop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "fused/block.hpp"
#include "fused/learning.hpp"
#include "fused/network.hpp"
#include "train/draws.hpp"
#include "train/environments.hpp"
#include "train/interaction.hpp"
#include "train/memory.hpp"
#include "train/priorities.hpp"
#include "train/settings.hpp"

namespace touchdown::train {

// The steps of each environment that are in no transition yet, as touchdown.replay.n_step keeps
// them: the oldest first; between two steps fewer than n, or with SARSA at most n.
struct Windows {
  float* o_tm1;           // [N][n][D]
  std::int32_t* a_tm1;    // [N][n]
  double* r_t;            // [N][n]
  std::int64_t* lengths;  // [N]
};

// Everything that the loop reads and writes, besides its counts.
struct Parts {
  Environments environments;
  Episodes episodes;
  Windows windows;
  Memory memory;
  SumTree priorities;  // of the memory, if it is prioritised
  fused::Learner learner;
  float* average;  // [P], of the online parameters; null: none
  float* q;        // [N][A]
  const BitGenerator& exploration;
  const BitGenerator& replay;
};

class Loop {
 public:
  // With a `mirror`, the image of each transition is stored too.
  Loop(const Settings& settings, const fused::Network& network,
       std::optional<Mirror> mirror = std::nullopt)
      : settings_(settings),
        network_(network),
        mirror_(std::move(mirror)),
        interaction_(settings, network) {}

  const Settings& settings() const { return settings_; }
  const fused::Network& network() const { return network_; }

  // See `Interaction::advance`.
  //
  // Throws std::invalid_argument if a stored transition has an action that the network does not.
  std::optional<fused::Metrics> advance(const Parts& parts, std::int64_t max_steps, Counts& counts);

 private:
  // Stores the transitions that the latest step of environment `i` completes.
  void store(const Parts& parts, const Acting& acting, std::size_t i, EpisodeEnd end,
             Counts& counts);
  // Stores the `complete` oldest steps of environment `i` as transitions that end with `last`,
  // which has o_t, a_t and whether the episode terminated, and removes them from its window.
  void store_oldest(const Parts& parts, std::size_t i, std::size_t complete, const Step& last,
                    Counts& counts);
  // What follows a step: the updates and the copy of the target network that are due after it.
  Learnt learn(const Parts& parts, Counts& counts);
  fused::Metrics update(const Parts& parts, std::int64_t count, Counts& counts);
  // Gives the place of the next transition the largest priority so far, if there are priorities.
  void prioritise_next(const Parts& parts, const Counts& counts) const;
  // Draws the transitions of all minibatches; refuses those whose action the network does not have.
  void draw(const Parts& parts, const fused::Samples& packed, std::int64_t count, Counts& counts);
  void need_action(std::int32_t action) const;

  Settings settings_;
  fused::Network network_;
  std::optional<Mirror> mirror_;
  Interaction interaction_;
  std::vector<std::int64_t> order_;  // [K·B]
  std::vector<float> rates_;         // [K]
  std::vector<float> td_error_;      // [K·B]
  std::vector<float> weights_;       // [K·B], of importance sampling
  std::vector<double> scratch_;      // [B]
  fused::Block block_;
};

}  // namespace touchdown::train
