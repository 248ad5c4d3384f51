// The layers of a Q-network for one panel of samples: each one's forward pass and, where it is more
// than a matrix product, its backward pass.
#pragma once

#include "fused/network.hpp"
#include "fused/panels.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

constexpr float kNormEpsilon = 1e-5f;  // equinox.nn.LayerNorm's

inline void linear_forward(const Linear& linear, const float* params, const float* in, float* out) {
  multiply(params + linear.weight, linear.in, 1, in, linear.out, linear.in, params + linear.bias,
           out);
}

// max(0, x). NaN stays NaN, so that it is noticed later.
inline Vector positive(Vector x) { return x < 0.0f ? Vector{} : x; }

inline void relu(float* x, int features) {
  for (int i = 0; i < features * kPanel; i += kWidth) store(x + i, positive(load(x + i)));
}

// One feature of all samples of a panel.
struct PanelRow {
  Vector left, right;
};

inline PanelRow row_of(const float* panel, int feature) {
  return {load(panel + feature * kPanel), load(panel + feature * kPanel + kWidth)};
}

inline void store_row(float* panel, int feature, const PanelRow& row) {
  store(panel + feature * kPanel, row.left);
  store(panel + feature * kPanel + kWidth, row.right);
}

// n = (x − mean)/σ over the features of each sample, then the ReLU of gain·n + shift, in place (Ba,
// Kiros & Hinton, 2016). Stores n and 1/σ unless their pointers are null.
//
// Sums over the features are chains, in which each addition waits for the one before: both halves
// of the panel go through them together.
inline void layer_norm_relu_forward(const float* gain, const float* shift, int features, float* x,
                                    float* normalized, float* inverse_sigma) {
  const auto count = static_cast<float>(features);
  PanelRow mean{};
  for (int i = 0; i < features; ++i) {
    const PanelRow row = row_of(x, i);
    mean.left += row.left;
    mean.right += row.right;
  }
  mean.left /= count;
  mean.right /= count;
  PanelRow variance{};
  for (int i = 0; i < features; ++i) {
    const PanelRow row = row_of(x, i);
    const Vector left = row.left - mean.left, right = row.right - mean.right;
    variance.left += left * left;
    variance.right += right * right;
  }
  const PanelRow scale{1.0f / square_root(variance.left / count + kNormEpsilon),
                       1.0f / square_root(variance.right / count + kNormEpsilon)};
  if (inverse_sigma) store_row(inverse_sigma, 0, scale);
  for (int i = 0; i < features; ++i) {
    const PanelRow row = row_of(x, i);
    const PanelRow n{(row.left - mean.left) * scale.left, (row.right - mean.right) * scale.right};
    if (normalized) store_row(normalized, i, n);
    store_row(x, i,
              {positive(gain[i] * n.left + shift[i]), positive(gain[i] * n.right + shift[i])});
  }
}

// ∂L/∂x from ∂L/∂(gain·n + shift).
inline void layer_norm_backward(const float* gain, int features, const float* norm_grad,
                                const float* normalized, const float* inverse_sigma, float* grad) {
  const auto count = static_cast<float>(features);
  PanelRow mean{}, along{};
  for (int i = 0; i < features; ++i) {
    const PanelRow from = row_of(norm_grad, i), n = row_of(normalized, i);
    const Vector left = gain[i] * from.left, right = gain[i] * from.right;
    mean.left += left;
    mean.right += right;
    along.left += left * n.left;
    along.right += right * n.right;
  }
  mean.left /= count;
  mean.right /= count;
  along.left /= count;
  along.right /= count;
  const PanelRow scale = row_of(inverse_sigma, 0);
  for (int i = 0; i < features; ++i) {
    const PanelRow from = row_of(norm_grad, i), n = row_of(normalized, i);
    const Vector left = gain[i] * from.left, right = gain[i] * from.right;
    store_row(grad, i,
              {scale.left * (left - mean.left - n.left * along.left),
               scale.right * (right - mean.right - n.right * along.right)});
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
