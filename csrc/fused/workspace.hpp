// The memory that an update works in: activations and gradients of a minibatch, panel by panel.
#pragma once

#include <cstddef>

#include "fused/network.hpp"
#include "fused/panels.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

// All arrays of one layer lie one panel behind the other.
struct Workspace {
  float* inputs;                       // [D][kPanel], of the panel at work
  float* input_samples;                // [samples][padded(D)]
  float* features[kMaxHidden];         // [panels][out][kPanel], after ReLU
  float* feature_samples[kMaxHidden];  // [samples][padded(out)], the same
  float* normalized[kMaxHidden];       // the same before gain and shift; with layer norm only
  float* inverse_sigma[kMaxHidden];    // [panels][kPanel]; with layer norm only
  float* features_grad[kMaxHidden];    // ∂L/∂ of the linear layer's output
  float* norm_grad[kMaxHidden];        // ∂L/∂ of the normalisation's output; with layer norm only
  float* value_grad;                   // [panels][1][kPanel]; dueling heads only
  float* advantage_grad;               // [panels][A][kPanel]
  float* scratch[2];                   // [widest][kPanel]: a layer's input and output
  float* q_tm1;                        // [A][kPanel]
  float* q_t;                          // [A][kPanel], of the network that bootstraps
  float* q_t_selector;                 // [A][kPanel], of the online network (double Q-learning)
  float* state_value;                  // [1][kPanel]
  float* gradient;                     // [P]
};

// Lays a workspace out in a block of memory, or only measures it if the block is null. Returns the
// number of floats.
inline std::size_t lay_out(const Network& network, int batch_size, float* block,
                           Workspace* workspace) {
  std::size_t used = 0;
  const auto part = [&](std::size_t floats) {
    float* const begin = block ? block + used : nullptr;
    used += (floats + 15) / 16 * 16;  // every part begins on a cache line
    return begin;
  };
  const std::size_t samples = static_cast<std::size_t>(num_panels(batch_size)) * kPanel;
  const auto num_actions = static_cast<std::size_t>(network.num_actions);
  const auto widest = static_cast<std::size_t>(network.widest);
  Workspace w{};
  w.inputs = part(static_cast<std::size_t>(network.num_observations) * kPanel);
  w.input_samples = part(samples * static_cast<std::size_t>(padded(network.num_observations)));
  for (int i = 0; i < network.num_hidden; ++i) {
    const auto out = static_cast<std::size_t>(network.hidden[i].linear.out);
    w.features[i] = part(samples * out);
    w.feature_samples[i] =
        part(samples * static_cast<std::size_t>(padded(network.hidden[i].linear.out)));
    w.features_grad[i] = part(samples * out);
    if (!network.layer_norm) continue;
    w.normalized[i] = part(samples * out);
    w.inverse_sigma[i] = part(samples);
    w.norm_grad[i] = part(samples * out);
  }
  w.value_grad = part(samples);
  w.advantage_grad = part(samples * num_actions);
  for (float*& scratch : w.scratch) scratch = part(widest * kPanel);
  w.q_tm1 = part(num_actions * kPanel);
  w.q_t = part(num_actions * kPanel);
  w.q_t_selector = part(num_actions * kPanel);
  w.state_value = part(kPanel);
  w.gradient = part(static_cast<std::size_t>(network.num_params) + kWidth);  // which spills over
  if (workspace) *workspace = w;
  return used;
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
