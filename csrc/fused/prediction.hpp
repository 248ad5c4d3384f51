// From what a head predicts of each action's return to Q(s,·), its mean.
//
// The columns of a panel [Z][kPanel] are returns of different samples or actions; one vector of
// them is computed at a time.
#pragma once

#include "fused/exponential.hpp"
#include "fused/network.hpp"
#include "fused/panels.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

// The returns that probabilities are predicted of, equally spaced from v_min to v_max.
struct Support {
  explicit Support(const Prediction& prediction)
      : first(prediction.v_min),
        step((prediction.v_max - prediction.v_min) / static_cast<float>(prediction.outputs - 1)) {}

  float operator[](int i) const { return first + static_cast<float>(i) * step; }

  float first;
  float step;
};

struct Softmax {
  Vector greatest;  // logit
  Vector total;     // Σ exp(logit − greatest)
};

// Logits to probabilities, [Z][kPanel] each; both may be the same.
inline Softmax softmax(const float* logits, int count, float* probabilities) {
  Softmax made{load(logits), Vector{}};
  for (int i = 1; i < count; ++i) {
    const Vector logit = load(logits + i * kPanel);
    made.greatest = logit > made.greatest ? logit : made.greatest;
  }
  for (int i = 0; i < count; ++i) {
    const Vector power = exponential(load(logits + i * kPanel) - made.greatest);
    made.total += power;
    store(probabilities + i * kPanel, power);
  }
  const Vector scale = 1.0f / made.total;
  for (int i = 0; i < count; ++i) {
    store(probabilities + i * kPanel, load(probabilities + i * kPanel) * scale);
  }
  return made;
}

// The mean return. Replaces logits by probabilities.
inline Vector mean_return(const Prediction& prediction, float* outputs) {
  Vector sum{};
  if (prediction.kind == Prediction::kAtoms) {
    softmax(outputs, prediction.outputs, outputs);
    const Support support(prediction);
    for (int i = 0; i < prediction.outputs; ++i) sum += load(outputs + i * kPanel) * support[i];
    return sum;
  }
  for (int i = 0; i < prediction.outputs; ++i) sum += load(outputs + i * kPanel);
  return sum / static_cast<float>(prediction.outputs);
}

// Q(s,·) [A][kPanel] of a panel of outputs [A·Z][kPanel]. If means are predicted, both are the same
// memory. Replaces logits by probabilities.
inline void action_values(const Network& network, float* outputs, float* q) {
  if (network.prediction.kind == Prediction::kMean) return;
  const int size = network.prediction.outputs * kPanel;
  for (int a = 0; a < network.num_actions; ++a) {
    for (int half = 0; half < kPanel; half += kWidth) {
      store(q + a * kPanel + half, mean_return(network.prediction, outputs + a * size + half));
    }
  }
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
