// The layers of a Q-network for one panel of samples: each one's forward pass and, where it is more
// than a matrix product, its backward pass.
#pragma once

#include <cmath>

#include "fused/network.hpp"
#include "fused/panels.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

constexpr float kNormEpsilon = 1e-5f;  // equinox.nn.LayerNorm's

inline void linear_forward(const Linear& linear, const float* params, const float* in, float* out) {
  multiply(params + linear.weight, linear.in, 1, in, linear.out, linear.in, params + linear.bias,
           out);
}

// max(0, x) in place. NaN stays NaN, so that it is noticed later.
inline void relu(float* x, int features) {
  for (int i = 0; i < features * kPanel; i += kWidth) {
    const Vector v = load(x + i);
    store(x + i, v < 0.0f ? Vector{} : v);
  }
}

// n = (x − mean)/σ over the features of each sample, then gain·n + shift, in place (Ba, Kiros &
// Hinton, 2016). Stores n and 1/σ unless their pointers are null.
inline void layer_norm_forward(const float* gain, const float* shift, int features, float* x,
                               float* normalized, float* inverse_sigma) {
  for (int half = 0; half < kPanel; half += kWidth) {
    Vector mean{};
    for (int i = 0; i < features; ++i) mean += load(x + i * kPanel + half);
    mean /= static_cast<float>(features);
    Vector variance{};
    for (int i = 0; i < features; ++i) {
      const Vector centred = load(x + i * kPanel + half) - mean;
      variance += centred * centred;
    }
    variance = variance / static_cast<float>(features) + kNormEpsilon;
    Vector scale;
    for (int lane = 0; lane < kWidth; ++lane) scale[lane] = 1.0f / std::sqrt(variance[lane]);
    if (inverse_sigma) store(inverse_sigma + half, scale);
    for (int i = 0; i < features; ++i) {
      const Vector n = (load(x + i * kPanel + half) - mean) * scale;
      if (normalized) store(normalized + i * kPanel + half, n);
      store(x + i * kPanel + half, gain[i] * n + shift[i]);
    }
  }
}

// ∂L/∂x from ∂L/∂(gain·n + shift).
inline void layer_norm_backward(const float* gain, int features, const float* norm_grad,
                                const float* normalized, const float* inverse_sigma, float* grad) {
  for (int half = 0; half < kPanel; half += kWidth) {
    Vector mean{}, along{};
    for (int i = 0; i < features; ++i) {
      const Vector d = gain[i] * load(norm_grad + i * kPanel + half);
      mean += d;
      along += d * load(normalized + i * kPanel + half);
    }
    mean /= static_cast<float>(features);
    along /= static_cast<float>(features);
    const Vector scale = load(inverse_sigma + half);
    for (int i = 0; i < features; ++i) {
      const Vector d = gain[i] * load(norm_grad + i * kPanel + half);
      const Vector n = load(normalized + i * kPanel + half);
      store(grad + i * kPanel + half, scale * (d - mean - n * along));
    }
  }
}

// The head's outputs [A·Z][kPanel]: V(s) + A(s,a) − mean A(s,·) for a dueling head (Wang et al.,
// 2016, Eq. 9), for each of an action's Z outputs; otherwise those of the one linear layer.
inline void head_forward(const Network& network, const float* params, const float* features,
                         float* state_value, float* outputs) {
  linear_forward(network.advantage, params, features, outputs);
  if (!network.dueling) return;
  linear_forward(network.value, params, features, state_value);
  const int size = network.prediction.outputs * kPanel;  // of one action
  for (int i = 0; i < size; i += kWidth) {
    Vector mean{};
    for (int a = 0; a < network.num_actions; ++a) mean += load(outputs + a * size + i);
    mean /= static_cast<float>(network.num_actions);
    const Vector level = load(state_value + i) - mean;
    for (int a = 0; a < network.num_actions; ++a) {
      store(outputs + a * size + i, load(outputs + a * size + i) + level);
    }
  }
}

// For a dueling head: from ∂L/∂ of its outputs in `advantage`, ∂L/∂A in place and ∂L/∂V into
// `value`.
inline void dueling_backward(const Network& network, float* advantage, float* value) {
  const int size = network.prediction.outputs * kPanel;  // of one action
  for (int i = 0; i < size; i += kWidth) {
    Vector all{};
    for (int a = 0; a < network.num_actions; ++a) all += load(advantage + a * size + i);
    store(value + i, all);
    const Vector mean = all / static_cast<float>(network.num_actions);
    for (int a = 0; a < network.num_actions; ++a) {
      store(advantage + a * size + i, load(advantage + a * size + i) - mean);
    }
  }
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
