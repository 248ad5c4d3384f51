// TD errors of a panel, its loss, and the loss's gradient with respect to Q(s,·).
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

#include "fused/learning.hpp"
#include "fused/network.hpp"
#include "fused/panels.hpp"
#include "fused/workspace.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

// Sums over a minibatch, for its metrics.
struct Totals {
  double loss = 0.0;
  double q = 0.0;
  float max_q = -std::numeric_limits<float>::infinity();

  // Adds the weighted loss of a sample, and its column of Q(s,·).
  void add(float weighted_loss, int num_actions, const float* column) {
    loss += weighted_loss;
    for (int a = 0; a < num_actions; ++a) {
      const float value = column[a * kPanel];
      q += value;
      if (!(value <= max_q)) max_q = value;  // NaN becomes the maximum
    }
  }
};

struct Loss {
  float value;
  float slope;  // ∂/∂Q
};

// The squared error δ², or Huber's loss with its knee at 1.
inline Loss loss_of(float td_error, bool huber) {
  const float size = std::fabs(td_error);
  if (!huber) return {td_error * td_error, -2.0f * td_error};
  if (size <= 1.0f) return {0.5f * td_error * td_error, -td_error};
  return {size - 0.5f, td_error > 0.0f ? -1.0f : 1.0f};
}

inline int greedy_action(const float* q, int num_actions, int column) {
  int best = 0;
  for (int a = 1; a < num_actions; ++a) {
    if (q[a * kPanel + column] > q[best * kPanel + column]) best = a;
  }
  return best;
}

// The TD errors of the `live` samples from number `first` on, and ∂L/∂Q of their panel. Reads the
// action values in `w`.
inline void td_errors(const Network& network, const Rule& rule, const Samples& samples,
                      std::ptrdiff_t first, int live, int batch_size, const float* weights,
                      const Workspace& w, float* advantage_grad, float* td_error, Totals* totals) {
  const int num_actions = network.num_actions;
  for (int i = 0; i < num_actions * kPanel; ++i) advantage_grad[i] = 0.0f;
  for (int c = 0; c < live; ++c) {
    const std::ptrdiff_t index = samples.order ? samples.order[first + c] : first + c;
    const std::ptrdiff_t at = index * samples.stride;
    float target = samples.r_t[at];
    if (samples.o_t) {
      const int action =
          rule.sarsa ? samples.a_t[at]
                     : greedy_action(rule.double_q ? w.q_t_selector : w.q_t, num_actions, c);
      target = target * rule.reward_scale + samples.discount_t[at] * w.q_t[action * kPanel + c];
    }
    const int taken = samples.a_tm1[at];
    const float error = target - w.q_tm1[taken * kPanel + c];
    td_error[c] = error;
    const float weight = weights ? weights[c] : 1.0f;
    const Loss loss = loss_of(error, rule.huber);
    advantage_grad[taken * kPanel + c] = weight * loss.slope / static_cast<float>(batch_size);
    totals->add(weight * loss.value, num_actions, w.q_tm1 + c);
  }
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
