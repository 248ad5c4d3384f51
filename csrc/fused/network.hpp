// The shape of a Q-network: a multilayer perceptron whose parameters lie in one flat array.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace touchdown::fused {

inline constexpr int kMaxHidden = 16;              // hidden layers
inline constexpr std::int64_t kMaxSize = 1 << 20;  // of a layer, and of a minibatch

// y = weight·x + bias; weight is [out][in]. `weight` and `bias` are offsets into the flat array.
struct Linear {
  int in = 0;
  int out = 0;
  std::ptrdiff_t weight = 0;
  std::ptrdiff_t bias = 0;
};

// A linear layer, layer normalisation if the network has it, and ReLU.
struct Hidden {
  Linear linear;
  std::ptrdiff_t gain = 0;
  std::ptrdiff_t shift = 0;
};

// What the outputs of one action say about its return.
struct Prediction {
  enum Kind { kMean, kQuantiles, kAtoms };

  Kind kind = kMean;
  int outputs = 1;     // Z, of each action
  float v_min = 0.0f;  // the smallest atom
  float v_max = 0.0f;  // the largest atom
};

// A prediction as touchdown.config.sections describes it; 0 quantiles and 0 atoms predict means.
// Throws std::invalid_argument for sizes out of range.
Prediction make_prediction(std::int64_t quantiles, std::int64_t atoms, double v_min, double v_max);

struct Network {
  int num_observations = 0;  // D
  int num_actions = 0;       // A
  int num_hidden = 0;
  bool layer_norm = false;
  bool dueling = false;
  bool noisy = false;
  Prediction prediction;
  Hidden hidden[kMaxHidden];
  Linear value;                    // of a dueling head, Z outputs
  Linear advantage;                // of a dueling head; without one, the head itself: A·Z outputs
  int widest = 0;                  // the most features that any layer takes or gives
  std::ptrdiff_t num_weights = 0;  // that an observation passes through; offsets are among these
  std::ptrdiff_t num_params = 0;   // P, that are learned: for noisy weights, µ and σ of each
  std::ptrdiff_t num_noise = 0;    // random numbers in a sample of noisy weights
};

// A network whose parameters have the order of touchdown.agents.networks: a layer's weight, its
// bias, then its normalisation's gain and shift; in a dueling head the value's before the
// advantages'. In a noisy network, the σ of a layer's weight and bias follow these two. Throws
// std::invalid_argument for sizes out of range.
Network make_network(std::int64_t num_observations, std::span<const std::int64_t> hidden_sizes,
                     std::int64_t num_actions, bool layer_norm, bool dueling,
                     const Prediction& prediction = {}, bool noisy = false);

}  // namespace touchdown::fused
