// TD errors, loss and its gradient for a panel of predicted distributions: quantiles (Dabney et
// al., 2018) or probabilities of atoms (Bellemare, Dabney & Munos, 2017).
//
// The equations are those of touchdown.agents.td; a lane of a vector is a sample.
#pragma once

#include <cmath>
#include <cstddef>
#include <type_traits>

#include "fused/learning.hpp"
#include "fused/network.hpp"
#include "fused/panels.hpp"
#include "fused/prediction.hpp"
#include "fused/td_error.hpp"
#include "fused/workspace.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

// What a panel's transitions have besides their observations. Columns without a sample are zero,
// but have no action.
struct alignas(64) Columns {
  float taken[kPanel];  // the action, as a number that vectors can compare
  float next[kPanel];   // the action that the target bootstraps on
  float reward[kPanel] = {};
  float discount[kPanel] = {};
  float weight[kPanel] = {};  // of a sample's loss, over the size of the minibatch
};

inline Columns columns_of(const Network& network, const Rule& rule, const Samples& samples,
                          std::ptrdiff_t first, int live, int batch_size, const float* weights,
                          const Workspace& w) {
  Columns columns;
  for (int c = 0; c < kPanel; ++c) columns.taken[c] = columns.next[c] = -1.0f;
  for (int c = 0; c < live; ++c) {
    const std::ptrdiff_t index = samples.order ? samples.order[first + c] : first + c;
    const std::ptrdiff_t at = index * samples.stride;
    const int next =
        rule.sarsa ? samples.a_t[at]
                   : greedy_action(rule.double_q ? w.q_t_selector : w.q_t, network.num_actions, c);
    columns.taken[c] = static_cast<float>(samples.a_tm1[at]);
    columns.next[c] = static_cast<float>(next);
    columns.reward[c] = samples.r_t[at] * rule.reward_scale;
    columns.discount[c] = samples.discount_t[at];
    columns.weight[c] = (weights ? weights[c] : 1.0f) / static_cast<float>(batch_size);
  }
  return columns;
}

// The outputs [Z][kPanel] of each column's own action, from those of all, [A·Z][kPanel].
inline void of_action(const Network& network, const float* outputs, const float* actions,
                      float* chosen) {
  const int size = network.prediction.outputs * kPanel;
  for (int i = 0; i < size; i += kWidth) {
    const Vector action = load(actions + i % kPanel);
    Vector found = load(outputs + i);
    for (int a = 1; a < network.num_actions; ++a) {
      found = action == static_cast<float>(a) ? load(outputs + a * size + i) : found;
    }
    store(chosen + i, found);
  }
}

// The inverse of `of_action`: the outputs of other actions are zero.
inline void to_action(const Network& network, const float* chosen, const float* actions,
                      float* outputs) {
  const int size = network.prediction.outputs * kPanel;
  for (int a = 0; a < network.num_actions; ++a) {
    for (int i = 0; i < size; i += kWidth) {
      const Vector action = load(actions + i % kPanel);
      store(outputs + a * size + i, action == static_cast<float>(a) ? load(chosen + i) : Vector{});
    }
  }
}

// The quantile Huber loss Σᵢ meanⱼ |τᵢ − 1{uᵢⱼ < 0}|·Huber(uᵢⱼ), uᵢⱼ = r + γ·θ′ⱼ − θᵢ, of one
// vector. Replaces the quantiles θ of `taken` by ∂/∂θ of the weighted loss, and θ′ of `next` by the
// target.
inline Vector quantile_loss(int count, Vector reward, Vector discount, Vector weight, float* taken,
                            float* next) {
  for (int j = 0; j < count; ++j) {
    store(next + j * kPanel, reward + discount * load(next + j * kPanel));
  }
  const float share = 1.0f / static_cast<float>(count);
  Vector loss{};
  for (int i = 0; i < count; ++i) {
    const float tau = (static_cast<float>(i) + 0.5f) * share;
    const Vector below = broadcast(1.0f - tau), above = broadcast(tau);
    const Vector theta = load(taken + i * kPanel);
    Vector slope{};
    for (int j = 0; j < count; ++j) {
      const Vector u = load(next + j * kPanel) - theta;
      Vector clipped = u < -1.0f ? broadcast(-1.0f) : u;
      clipped = clipped > 1.0f ? broadcast(1.0f) : clipped;
      const Vector term = (u < 0.0f ? below : above) * clipped;
      slope += term;
      loss += term * (u - 0.5f * clipped);  // Huber's loss is clipped·(u − clipped/2)
    }
    store(taken + i * kPanel, -share * weight * slope);
  }
  return share * loss;
}

// max(0, 1 − |x|), which shares a probability between the two atoms beside its place. NaN stays
// NaN.
inline Vector share_at(Vector x) {
  // Comparisons of floats would take twice the time. As whole numbers, floats have the same signs.
  const auto size = reinterpret_cast<Vector>(reinterpret_cast<IntVector>(x) & 0x7fffffff);
  const auto share = reinterpret_cast<IntVector>(1.0f - size);
  return reinterpret_cast<Vector>(share > 0 ? share : IntVector{});
}

struct CategoricalLoss {
  Vector loss;
  Vector target;  // the mean return of the projected distribution
};

// The cross entropy −Σᵢ Φᵢ·log pᵢ of one vector, with Φ the probabilities of r + γ·zⱼ shared
// between the nearest atoms. Replaces the logits of `taken` by ∂/∂ of the weighted loss, and the
// probabilities of `next` by their places among the atoms. Overwrites `work`; each is [Z][kPanel].
inline CategoricalLoss categorical_loss(const Prediction& prediction, Vector reward,
                                        Vector discount, Vector weight, float* taken, float* next,
                                        float* work) {
  const int count = prediction.outputs;
  const Support support(prediction);
  const Vector least = broadcast(prediction.v_min), greatest = broadcast(prediction.v_max);
  float* const place = work + count * kPanel;
  for (int j = 0; j < count; ++j) {
    Vector moved = reward + discount * support[j];
    moved = moved < least ? least : moved;
    moved = moved > greatest ? greatest : moved;
    store(place + j * kPanel, (moved - least) / support.step);
  }
  const Softmax made = softmax(taken, count, work);
  Vector log_total;
  for (int lane = 0; lane < kWidth; ++lane) log_total[lane] = std::log(made.total[lane]);
  CategoricalLoss found{};
  Vector mass{};
  // Several sums at once, as one would wait for itself.
  for_each_tile<4>(count, [&]<int kRows>(int first, std::integral_constant<int, kRows>) {
    Vector projected[kRows] = {};
    for (int j = 0; j < count; ++j) {
      const Vector from = load(place + j * kPanel), probability = load(next + j * kPanel);
      for (int i = 0; i < kRows; ++i) {
        projected[i] += share_at(from - static_cast<float>(first + i)) * probability;
      }
    }
    for (int i = first; i < first + kRows; ++i) {
      const Vector target = projected[i - first];
      found.loss -= target * (load(taken + i * kPanel) - made.greatest - log_total);
      found.target += target * support[i];
      mass += target;
      store(taken + i * kPanel, target);
    }
  });
  for (int i = 0; i < count; ++i) {
    store(taken + i * kPanel, weight * (load(work + i * kPanel) * mass - load(taken + i * kPanel)));
  }
  return found;
}

// As `td_errors`, for a network that predicts a distribution. Reads the outputs and action values
// in `w`, and computes those of `tm1`.
inline void distribution_errors(const Network& network, const Rule& rule, const Samples& samples,
                                std::ptrdiff_t first, int live, int batch_size,
                                const float* weights, const Workspace& w, float* advantage_grad,
                                float* td_error, Totals* totals) {
  const Prediction& prediction = network.prediction;
  const Columns columns = columns_of(network, rule, samples, first, live, batch_size, weights, w);
  of_action(network, w.outputs_tm1, columns.taken, w.taken);
  of_action(network, w.outputs_t, columns.next, w.next);
  action_values(network, w.outputs_tm1, w.q_tm1);
  alignas(64) float loss[kPanel], target[kPanel];
  for (int half = 0; half < kPanel; half += kWidth) {
    const Vector reward = load(columns.reward + half), discount = load(columns.discount + half);
    const Vector weight = load(columns.weight + half);
    if (prediction.kind == Prediction::kAtoms) {
      const CategoricalLoss found = categorical_loss(prediction, reward, discount, weight,
                                                     w.taken + half, w.next + half, w.work + half);
      store(loss + half, found.loss);
      store(target + half, found.target);
    } else {
      store(loss + half, quantile_loss(prediction.outputs, reward, discount, weight, w.taken + half,
                                       w.next + half));
      store(target + half, mean_return(prediction, w.next + half));
    }
  }
  to_action(network, w.taken, columns.taken, advantage_grad);
  for (int c = 0; c < live; ++c) {
    td_error[c] = target[c] - w.q_tm1[static_cast<int>(columns.taken[c]) * kPanel + c];
    totals->add((weights ? weights[c] : 1.0f) * loss[c], network.num_actions, w.q_tm1 + c);
  }
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
