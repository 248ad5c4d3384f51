// What an update of a Q-network reads and writes, and a sequence of updates.
#pragma once

#include <cstddef>
#include <cstdint>

#include "fused/network.hpp"
#include "fused/noise.hpp"

namespace touchdown::fused {

// Where transitions lie, field by field: sample number `index` is at `field + stride·index`.
struct Samples {
  const float* o_tm1 = nullptr;
  const std::int32_t* a_tm1 = nullptr;
  const float* r_t = nullptr;  // the target itself if there is no o_t
  const float* discount_t = nullptr;
  const float* o_t = nullptr;
  const std::int32_t* a_t = nullptr;
  std::ptrdiff_t observation_stride = 0;
  std::ptrdiff_t stride = 0;
  const std::int64_t* order = nullptr;  // [K·B] indices; null: 0, 1, 2, ...
};

// Samples in an array of packed transitions.
Samples packed_samples(const float* transitions, int num_observations);

// How an update is computed.
struct Rule {
  bool huber = false;
  bool double_q = false;
  bool sarsa = false;
  float reward_scale = 1.0f;
  float max_grad_norm = 0.0f;  // 0: no gradient clipping
  float polyak = 0.0f;         // the soft update's rate; 0: no soft update
  float b1 = 0.9f;
  float b2 = 0.999f;
  float epsilon = 1e-8f;
};

// The arrays that an update changes.
struct Learner {
  float* online = nullptr;  // [P]
  float* target = nullptr;  // [P]; null: the online network bootstraps
  float* mu = nullptr;      // [P], Adam's first moment
  float* nu = nullptr;      // [P], Adam's second moment
};

// Adam's step size and its bias corrections 1 − β₁ᵗ and 1 − β₂ᵗ, t = 1 for the first update.
struct StepSize {
  float rate = 0.0f;
  float correction1 = 1.0f;
  float correction2 = 1.0f;
};

StepSize step_size(const Rule& rule, float rate, double t);

struct Metrics {
  float loss = 0.0f;
  float mean_q = 0.0f;
  float max_q = 0.0f;
  float gradient_norm = 0.0f;
};

// K updates of minibatches of B, and how many came before them.
struct Updates {
  std::int64_t num_before = 0;
  std::size_t count = 0;           // K
  int batch_size = 0;              // B
  const float* rates = nullptr;    // [K]
  const float* weights = nullptr;  // [K·B]; null: all are 1
  NoiseSource noise;               // of the first update; noisy networks only
  float* td_error = nullptr;       // [K·B], written
};

// The number of floats that `run_updates` needs to work in.
std::size_t updates_workspace(const Network& network, int batch_size);

// Runs the updates in order and returns the metrics of the last one.
Metrics run_updates(const Network& network, const Rule& rule, const Learner& learner,
                    const Samples& samples, const Updates& updates, float* workspace);

}  // namespace touchdown::fused
