// A multilayer perceptron's shape, and what an update of it reads and writes, as plain memory.
//
// This header is compiled once for each instruction set: it holds no code that could be shared
// between them, as the linker would keep any one of the copies.
#pragma once

#include <cstddef>
#include <cstdint>

namespace touchdown::fused {

constexpr int kMostHidden = 16;  // layers
constexpr float kNormEpsilon = 1e-5f;  // equinox.nn.LayerNorm's

// y = weight·x + bias, by where its parameters lie in the flat vector; weight is [out][in].
struct Linear {
  int in = 0;
  int out = 0;
  std::ptrdiff_t weight = 0;
  std::ptrdiff_t bias = 0;
};

// A layer with ReLU after it, normalised before that where the network is.
struct Hidden {
  Linear linear;
  std::ptrdiff_t gain = 0;
  std::ptrdiff_t shift = 0;
};

struct Network {
  int num_observations = 0;  // D
  int num_actions = 0;       // A
  int num_hidden = 0;
  bool layer_norm = false;
  bool dueling = false;
  Hidden hidden[kMostHidden];
  Linear value;      // of a dueling head, one output
  Linear advantage;  // of a dueling head; of another, the action values themselves
  int widest = 0;    // most features that any layer takes or gives
  std::ptrdiff_t num_params = 0;  // P
};

// Where transitions lie: field by field, a sample's at `field + stride·index`.
struct Samples {
  const float* o_tm1 = nullptr;
  const std::int32_t* a_tm1 = nullptr;
  const float* r_t = nullptr;  // the target itself where there is no o_t
  const float* discount_t = nullptr;
  const float* o_t = nullptr;
  const std::int32_t* a_t = nullptr;
  std::ptrdiff_t observation_stride = 0;
  std::ptrdiff_t stride = 0;
  const std::int64_t* order = nullptr;  // [K·B] indices; none: 0, 1, 2, ...
};

struct Rule {
  bool huber = false;
  bool double_q = false;
  bool sarsa = false;
  float reward_scale = 1.0f;
  float max_grad_norm = 0.0f;  // 0: gradients are not clipped
  float polyak = 0.0f;         // 0: the target does not follow
  float b1 = 0.9f;
  float b2 = 0.999f;
  float epsilon = 1e-8f;
};

// What an update reads and writes.
struct Learner {
  float* online = nullptr;  // [P]
  float* target = nullptr;  // [P]; none: the online network bootstraps
  float* mu = nullptr;      // [P], Adam's first moment
  float* nu = nullptr;      // [P], its second
};

// Of one update. Corrections are 1 − βᵗ: powers are taken outside, in double precision.
struct StepSize {
  float rate = 0.0f;
  float correction1 = 1.0f;
  float correction2 = 1.0f;
};

struct Metrics {
  float loss = 0.0f;
  float mean_q = 0.0f;
  float max_q = 0.0f;
  float gradient_norm = 0.0f;
};

// What one instruction set has to offer.
struct Kernel {
  const char* name;
  // floats that `update` needs to work in, for minibatches of so many transitions
  std::size_t (*workspace)(const Network& network, int batch_size);
  // floats that `values` needs
  std::size_t (*values_workspace)(const Network& network);
  void (*values)(const Network& network, const float* params, const float* observations,
                 std::ptrdiff_t count, float* workspace, float* q);
  Metrics (*update)(const Network& network, const Rule& rule, const Learner& learner,
                    const StepSize& step, const Samples& samples, std::ptrdiff_t first,
                    int batch_size, const float* weights, float* workspace, float* td_error);
};

// The widest that this machine has.
const Kernel& kernel();

}  // namespace touchdown::fused
