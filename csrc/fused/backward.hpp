// The backward pass: from ∂L/∂Q to the gradient of every parameter.
#pragma once

#include <cstddef>

#include "fused/layers.hpp"
#include "fused/network.hpp"
#include "fused/panels.hpp"
#include "fused/workspace.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

// For one panel: from ∂L/∂ of the head's outputs in `advantage_grad` to the gradient of every
// layer's outputs.
inline void backward(const Network& network, const float* params, const Workspace& w, int panel) {
  float* const advantage =
      w.advantage_grad + static_cast<std::ptrdiff_t>(panel) * network.advantage.out * kPanel;
  float* const value =
      w.value_grad + static_cast<std::ptrdiff_t>(panel) * network.prediction.outputs * kPanel;
  if (network.dueling) dueling_backward(network, advantage, value);
  for (int i = network.num_hidden - 1; i >= 0; --i) {
    const Hidden& layer = network.hidden[i];
    const int features = layer.linear.out;
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(panel) * features * kPanel;
    float* const grad = (network.layer_norm ? w.norm_grad[i] : w.features_grad[i]) + at;
    const bool last = i == network.num_hidden - 1;
    const Linear& next = last ? network.advantage : network.hidden[i + 1].linear;
    const float* const next_grad =
        last ? advantage
             : w.features_grad[i + 1] + static_cast<std::ptrdiff_t>(panel) * next.out * kPanel;
    // weightᵀ·gradient of the next layer, then the derivative of ReLU
    multiply(params + next.weight, 1, next.in, next_grad, features, next.out, nullptr, grad);
    if (last && network.dueling) {
      multiply<Start::kSums>(params + network.value.weight, 1, features, value, features,
                             network.value.out, nullptr, grad);
    }
    const float* const output = w.features[i] + at;
    for (int f = 0; f < features * kPanel; f += kWidth) {
      store(grad + f, load(output + f) > 0.0f ? load(grad + f) : Vector{});
    }
    if (network.layer_norm) {
      layer_norm_backward(params + layer.gain, features, grad, w.normalized[i] + at,
                          w.inverse_sigma[i] + panel * kPanel, w.features_grad[i] + at);
    }
  }
}

// The gradient of a linear layer from that of its outputs, in panels, and its inputs, in samples.
inline void linear_gradient(const Linear& linear, const float* grad, const float* in, int panels,
                            float* gradient) {
  const std::ptrdiff_t grad_panel = static_cast<std::ptrdiff_t>(linear.out) * kPanel;
  sum_outer_products(grad, grad_panel, linear.out, in, linear.in, panels, gradient + linear.weight);
  sum_samples(linear.out, panels, gradient + linear.bias, [&](int panel, int f) {
    const float* const from = grad + panel * grad_panel + f * kPanel;
    return load(from) + load(from + kWidth);
  });
}

// The gradient of all parameters over the whole minibatch, from what the forward and the backward
// pass of its panels have stored.
inline void parameter_gradient(const Network& network, const Workspace& w, int panels) {
  const float* in = w.input_samples;
  // In the order of the parameters: a weight gradient spills into what lies behind it.
  for (int i = 0; i < network.num_hidden; ++i) {
    const Hidden& layer = network.hidden[i];
    const int features = layer.linear.out;
    linear_gradient(layer.linear, w.features_grad[i], in, panels, w.gradient);
    if (network.layer_norm) {
      const float *const grad = w.norm_grad[i], *const normalized = w.normalized[i];
      sum_samples(features, panels, w.gradient + layer.gain, [&](int panel, int f) {
        const std::ptrdiff_t at = (static_cast<std::ptrdiff_t>(panel) * features + f) * kPanel;
        return load(grad + at) * load(normalized + at) +
               load(grad + at + kWidth) * load(normalized + at + kWidth);
      });
      sum_samples(features, panels, w.gradient + layer.shift, [&](int panel, int f) {
        const std::ptrdiff_t at = (static_cast<std::ptrdiff_t>(panel) * features + f) * kPanel;
        return load(grad + at) + load(grad + at + kWidth);
      });
    }
    in = w.feature_samples[i];
  }
  if (network.dueling) linear_gradient(network.value, w.value_grad, in, panels, w.gradient);
  linear_gradient(network.advantage, w.advantage_grad, in, panels, w.gradient);
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
