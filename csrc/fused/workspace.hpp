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
  float* value_grad;                   // [panels][Z][kPanel]; dueling heads only
  float* advantage_grad;               // [panels][A·Z][kPanel]
  float* scratch[2];                   // [widest][kPanel]: a layer's input and output
  float* q_tm1;                        // [A][kPanel]
  float* q_t;                          // [A][kPanel], of the network that bootstraps
  float* q_t_selector;                 // [A][kPanel], of the online network (double Q-learning)
  float* outputs_tm1;                  // [A·Z][kPanel]; if means are predicted, these are q_tm1
  float* outputs_t;                    // the same, of q_t
  float* outputs_selector;             // the same, of q_t_selector
  float* taken;                        // [Z][kPanel], of the action taken; distributions only
  float* next;                         // [Z][kPanel], of the next action; distributions only
  float* work;                         // [2·Z][kPanel]; distributions only
  float* state_value;                  // [Z][kPanel]
  float* gradient;                     // of the weights
  float* learned_gradient;             // [P]; if no weights are noisy, this is the same
  float* sampled[3];                   // noisy weights of each forward pass; noisy networks only
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
  const auto num_outputs = static_cast<std::size_t>(network.advantage.out);
  const auto each = static_cast<std::size_t>(network.prediction.outputs);
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
  w.value_grad = part(samples * each);
  w.advantage_grad = part(samples * num_outputs);
  for (float*& scratch : w.scratch) scratch = part(widest * kPanel);
  w.q_tm1 = part(num_actions * kPanel);
  w.q_t = part(num_actions * kPanel);
  w.q_t_selector = part(num_actions * kPanel);
  w.outputs_tm1 = w.q_tm1;
  w.outputs_t = w.q_t;
  w.outputs_selector = w.q_t_selector;
  if (network.prediction.kind != Prediction::kMean) {
    w.outputs_tm1 = part(num_outputs * kPanel);
    w.outputs_t = part(num_outputs * kPanel);
    w.outputs_selector = part(num_outputs * kPanel);
    w.taken = part(each * kPanel);
    w.next = part(each * kPanel);
    w.work = part(2 * each * kPanel);
  }
  w.state_value = part(each * kPanel);
  const auto num_weights = static_cast<std::size_t>(network.num_weights);
  w.gradient = w.learned_gradient = part(num_weights + kWidth);  // which spills over
  if (network.noisy) {
    w.learned_gradient = part(static_cast<std::size_t>(network.num_params));
    for (float*& sampled : w.sampled) sampled = part(num_weights);
  }
  if (workspace) *workspace = w;
  return used;
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
