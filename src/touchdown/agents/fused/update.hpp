// One update of a small Q-network: forward, TD error, backward, clip and Adam, with no call between.
//
// Deep Q-learning's step as touchdown.agents.learner has it for JAX, which is its slow twin in the
// tests. The minibatch goes through in panels of samples that stay in the first cache; only the
// weights' gradient is taken over all of them at once.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "network.hpp"
#include "tiles.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

// Where an update works. Every layer's panels lie one behind the other.
struct Workspace {
  float* inputs;                  // [panels][D][kPanel]
  float* features[kMostHidden];   // [panels][out][kPanel], after ReLU
  float* normal[kMostHidden];     // the same before gain and shift; normalised networks only
  float* scales[kMostHidden];     // [panels][kPanel], 1/σ; normalised networks only
  float* features_grad[kMostHidden];  // of what the linear layer gives
  float* outputs_grad[kMostHidden];   // of the normalisation's output; normalised networks only
  float* value_grad;              // [panels][1][kPanel]; dueling heads only
  float* advantage_grad;          // [panels][A][kPanel]
  float* now;                     // [widest][kPanel]
  float* next;                    // [widest][kPanel]
  float* values;                  // [A][kPanel], of the online network
  float* values_t;                // [A][kPanel], of the network that bootstraps
  float* selection;               // [A][kPanel], of the online network at o_t
  float* value;                   // [1][kPanel]
  float* gradient;                // [P]
};

inline int panels_of(int batch_size) { return (batch_size + kPanel - 1) / kPanel; }

// Cuts a workspace out of one block, or measures it where the block is none.
inline std::size_t lay_out(const Network& network, int batch_size, float* block,
                           Workspace* workspace) {
  std::size_t used = 0;
  const auto cut = [&](std::size_t floats) {
    float* const part = block ? block + used : nullptr;
    used += (floats + 15) / 16 * 16;  // every part begins on a cache line
    return part;
  };
  const std::size_t samples = static_cast<std::size_t>(panels_of(batch_size)) * kPanel;
  Workspace w{};
  w.inputs = cut(samples * network.num_observations);
  for (int i = 0; i < network.num_hidden; ++i) {
    const std::size_t out = network.hidden[i].linear.out;
    w.features[i] = cut(samples * out);
    w.features_grad[i] = cut(samples * out);
    if (!network.layer_norm) continue;
    w.normal[i] = cut(samples * out);
    w.scales[i] = cut(samples);
    w.outputs_grad[i] = cut(samples * out);
  }
  w.value_grad = cut(samples);
  w.advantage_grad = cut(samples * network.num_actions);
  w.now = cut(static_cast<std::size_t>(network.widest) * kPanel);
  w.next = cut(static_cast<std::size_t>(network.widest) * kPanel);
  w.values = cut(static_cast<std::size_t>(network.num_actions) * kPanel);
  w.values_t = cut(static_cast<std::size_t>(network.num_actions) * kPanel);
  w.selection = cut(static_cast<std::size_t>(network.num_actions) * kPanel);
  w.value = cut(kPanel);
  w.gradient = cut(static_cast<std::size_t>(network.num_params));
  if (workspace) *workspace = w;
  return used;
}

inline void apply_linear(const Linear& linear, const float* params, const float* in, float* out) {
  multiply(params + linear.weight, linear.in, 1, in, linear.out, linear.in, params + linear.bias,
           out);
}

// max(0, x) in place; what is not a number stays so, and is noticed later.
inline void rectify(float* x, int features) {
  for (int i = 0; i < features * kPanel; i += kWidth) {
    const Vector v = load(x + i);
    store(x + i, v < 0.0f ? Vector{} : v);
  }
}

// n = (x − mean)/σ over the features of each sample, then gain·n + shift, in place (Ba, Kiros &
// Hinton, 2016). Keeps n and 1/σ where they are asked for.
inline void normalise(const float* gain, const float* shift, int features, float* x, float* normal,
                      float* scales) {
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
    if (scales) store(scales + half, scale);
    for (int i = 0; i < features; ++i) {
      const Vector n = (load(x + i * kPanel + half) - mean) * scale;
      if (normal) store(normal + i * kPanel + half, n);
      store(x + i * kPanel + half, gain[i] * n + shift[i]);
    }
  }
}

// Q(s,a) = V(s) + A(s,a) − mean A(s,·) (Wang et al., 2016, Eq. 9), or the outputs themselves.
inline void apply_head(const Network& network, const float* params, const float* features,
                       float* value, float* q) {
  apply_linear(network.advantage, params, features, q);
  if (!network.dueling) return;
  apply_linear(network.value, params, features, value);
  for (int half = 0; half < kPanel; half += kWidth) {
    Vector mean{};
    for (int a = 0; a < network.num_actions; ++a) mean += load(q + a * kPanel + half);
    mean /= static_cast<float>(network.num_actions);
    const Vector level = load(value + half) - mean;
    for (int a = 0; a < network.num_actions; ++a) {
      store(q + a * kPanel + half, load(q + a * kPanel + half) + level);
    }
  }
}

// Q(s,·) of the panel in `now`, which is used up.
inline void look(const Network& network, const float* params, float* now, float* next,
                 float* value, float* q) {
  for (int i = 0; i < network.num_hidden; ++i) {
    const Hidden& layer = network.hidden[i];
    apply_linear(layer.linear, params, now, next);
    if (network.layer_norm) {
      normalise(params + layer.gain, params + layer.shift, layer.linear.out, next, nullptr,
                nullptr);
    }
    rectify(next, layer.linear.out);
    float* const used = now;
    now = next;
    next = used;
  }
  apply_head(network, params, now, value, q);
}

// The same, keeping all that going back needs.
inline void look_and_keep(const Network& network, const float* params, const Workspace& w,
                          int panel) {
  const float* in = w.inputs + static_cast<std::ptrdiff_t>(panel) * network.num_observations * kPanel;
  for (int i = 0; i < network.num_hidden; ++i) {
    const Hidden& layer = network.hidden[i];
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(panel) * layer.linear.out * kPanel;
    float* const out = w.features[i] + at;
    apply_linear(layer.linear, params, in, out);
    if (network.layer_norm) {
      normalise(params + layer.gain, params + layer.shift, layer.linear.out, out, w.normal[i] + at,
                w.scales[i] + panel * kPanel);
    }
    rectify(out, layer.linear.out);
    in = out;
  }
  apply_head(network, params, in, w.value, w.values);
}

// ∂L/∂x of a normalisation from ∂L/∂(gain·n + shift), for one panel.
inline void normalise_back(const float* gain, int features, const float* outputs_grad,
                           const float* normal, const float* scales, float* grad) {
  for (int half = 0; half < kPanel; half += kWidth) {
    Vector mean{}, along{};
    for (int i = 0; i < features; ++i) {
      const Vector d = gain[i] * load(outputs_grad + i * kPanel + half);
      mean += d;
      along += d * load(normal + i * kPanel + half);
    }
    mean /= static_cast<float>(features);
    along /= static_cast<float>(features);
    const Vector scale = load(scales + half);
    for (int i = 0; i < features; ++i) {
      const Vector d = gain[i] * load(outputs_grad + i * kPanel + half);
      const Vector n = load(normal + i * kPanel + half);
      store(grad + i * kPanel + half, scale * (d - mean - n * along));
    }
  }
}

// From ∂L/∂Q of one panel, in `advantage_grad`, to the gradient of every layer's outputs.
inline void go_back(const Network& network, const float* params, const Workspace& w, int panel) {
  float* const advantage =
      w.advantage_grad + static_cast<std::ptrdiff_t>(panel) * network.num_actions * kPanel;
  float* const value = w.value_grad + panel * kPanel;
  if (network.dueling) {
    for (int half = 0; half < kPanel; half += kWidth) {
      Vector all{};
      for (int a = 0; a < network.num_actions; ++a) all += load(advantage + a * kPanel + half);
      store(value + half, all);
      const Vector mean = all / static_cast<float>(network.num_actions);
      for (int a = 0; a < network.num_actions; ++a) {
        store(advantage + a * kPanel + half, load(advantage + a * kPanel + half) - mean);
      }
    }
  }
  for (int i = network.num_hidden - 1; i >= 0; --i) {
    const Hidden& layer = network.hidden[i];
    const int features = layer.linear.out;
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(panel) * features * kPanel;
    float* const grad = (network.layer_norm ? w.outputs_grad[i] : w.features_grad[i]) + at;
    const bool last = i == network.num_hidden - 1;
    const Linear& after = last ? network.advantage : network.hidden[i + 1].linear;
    const float* const after_grad =
        last ? advantage
             : w.features_grad[i + 1] + static_cast<std::ptrdiff_t>(panel) * after.out * kPanel;
    multiply(params + after.weight, 1, after.in, after_grad, features, after.out, nullptr, grad);
    const float* const kept = w.features[i] + at;
    for (int f = 0; f < features; ++f) {
      const float by_value = last && network.dueling ? params[network.value.weight + f] : 0.0f;
      for (int half = 0; half < kPanel; half += kWidth) {
        Vector d = load(grad + f * kPanel + half);
        if (last && network.dueling) d += by_value * load(value + half);
        store(grad + f * kPanel + half, load(kept + f * kPanel + half) > 0.0f ? d : Vector{});
      }
    }
    if (network.layer_norm) {
      normalise_back(params + layer.gain, features, grad, w.normal[i] + at,
                     w.scales[i] + panel * kPanel, w.features_grad[i] + at);
    }
  }
}

inline void linear_gradient(const Linear& linear, const float* grad, const float* in, int panels,
                            float* gradient) {
  const std::ptrdiff_t apart = static_cast<std::ptrdiff_t>(linear.out) * kPanel;
  correlate(grad, apart, linear.out, in, static_cast<std::ptrdiff_t>(linear.in) * kPanel, linear.in,
            panels, gradient + linear.weight);
  total(grad, apart, linear.out, panels, gradient + linear.bias);
}

// The whole minibatch's gradient, from what `look_and_keep` and `go_back` left.
inline void weights_gradient(const Network& network, const Workspace& w, int panels) {
  const float* in = w.inputs;
  for (int i = 0; i < network.num_hidden; ++i) {
    const Hidden& layer = network.hidden[i];
    linear_gradient(layer.linear, w.features_grad[i], in, panels, w.gradient);
    if (network.layer_norm) {
      const std::ptrdiff_t apart = static_cast<std::ptrdiff_t>(layer.linear.out) * kPanel;
      total(w.outputs_grad[i], apart, layer.linear.out, panels, w.gradient + layer.shift);
      for (int f = 0; f < layer.linear.out; ++f) {
        correlate_tile<1, 1>(w.outputs_grad[i] + f * kPanel, apart, w.normal[i] + f * kPanel, apart,
                             panels, w.gradient + layer.gain + f, 1);
      }
    }
    in = w.features[i];
  }
  if (network.dueling) linear_gradient(network.value, w.value_grad, in, panels, w.gradient);
  linear_gradient(network.advantage, w.advantage_grad, in, panels, w.gradient);
}

// Clips the gradient's norm and takes Adam's step (Kingma & Ba, 2015); gives the norm before.
inline float descend(const Network& network, const Rule& rule, const Learner& learner,
                     const StepSize& step, const float* gradient) {
  const std::ptrdiff_t count = network.num_params;
  Vector squares{};
  std::ptrdiff_t i = 0;
  for (; i + kWidth <= count; i += kWidth) {
    const Vector g = load(gradient + i);
    squares += g * g;
  }
  float square = sum(squares);
  for (; i < count; ++i) square += gradient[i] * gradient[i];
  const float norm = std::sqrt(square);
  const bool clips = rule.max_grad_norm > 0.0f && !(norm < rule.max_grad_norm);
  const float shrink = clips ? rule.max_grad_norm / norm : 1.0f;
  const float scale1 = 1.0f / step.correction1, scale2 = 1.0f / step.correction2;
  // copies, and no aliases: otherwise the loops are not turned into vectors
  const float b1 = rule.b1, b2 = rule.b2, epsilon = rule.epsilon, rate = step.rate;
  float* __restrict const online = learner.online;
  float* __restrict const mu = learner.mu;
  float* __restrict const nu = learner.nu;
  const float* __restrict const slope = gradient;
  for (i = 0; i < count; ++i) {
    const float g = slope[i] * shrink;
    const float m = b1 * mu[i] + (1.0f - b1) * g;
    const float v = b2 * nu[i] + (1.0f - b2) * (g * g);
    mu[i] = m;
    nu[i] = v;
    online[i] -= rate * (m * scale1) / (std::sqrt(v * scale2) + epsilon);
  }
  if (rule.polyak > 0.0f) {
    const float share = rule.polyak;
    float* __restrict const target = learner.target;
    for (i = 0; i < count; ++i) target[i] += share * (online[i] - target[i]);
  }
  return norm;
}

// Observations of some samples as one panel; columns beyond them are zero.
inline void gather(const float* field, const Samples& samples, std::ptrdiff_t first, int live,
                   int width, float* panel) {
  for (int c = 0; c < kPanel; ++c) {
    if (c >= live) {
      for (int d = 0; d < width; ++d) panel[d * kPanel + c] = 0.0f;
      continue;
    }
    const std::ptrdiff_t index = samples.order ? samples.order[first + c] : first + c;
    const float* const row = field + index * samples.observation_stride;
    for (int d = 0; d < width; ++d) panel[d * kPanel + c] = row[d];
  }
}

inline int best_of(const float* q, int num_actions, int column) {
  int best = 0;
  for (int a = 1; a < num_actions; ++a) {
    if (q[a * kPanel + column] > q[best * kPanel + column]) best = a;
  }
  return best;
}

struct Totals {
  double loss = 0.0;
  double q = 0.0;
  float most = -std::numeric_limits<float>::infinity();
};

// TD errors of one panel's samples, and ∂L/∂Q of them.
inline void judge(const Network& network, const Rule& rule, const Samples& samples,
                  std::ptrdiff_t first, int live, int batch_size, const float* weights,
                  const Workspace& w, float* advantage_grad, float* td_error, Totals* totals) {
  const int num_actions = network.num_actions;
  for (int i = 0; i < num_actions * kPanel; ++i) advantage_grad[i] = 0.0f;
  for (int c = 0; c < live; ++c) {
    const std::ptrdiff_t index = samples.order ? samples.order[first + c] : first + c;
    const std::ptrdiff_t at = index * samples.stride;
    float target = samples.r_t[at];
    if (samples.o_t) {
      int action;
      if (rule.sarsa) {
        action = samples.a_t[at];
      } else {
        action = best_of(rule.double_q ? w.selection : w.values_t, num_actions, c);
      }
      target = target * rule.reward_scale + samples.discount_t[at] * w.values_t[action * kPanel + c];
    }
    const int taken = samples.a_tm1[at];
    const float error = target - w.values[taken * kPanel + c];
    td_error[c] = error;
    const float weight = weights ? weights[c] : 1.0f;
    const float size = std::fabs(error);
    // ∂/∂Q of Huber's loss with its knee at 1, or of the square
    float slope = -2.0f * error;
    float loss = error * error;
    if (rule.huber) {
      slope = size <= 1.0f ? -error : (error > 0.0f ? -1.0f : 1.0f);
      loss = size <= 1.0f ? 0.5f * error * error : size - 0.5f;
    }
    advantage_grad[taken * kPanel + c] = weight * slope / static_cast<float>(batch_size);
    totals->loss += weight * loss;
    for (int a = 0; a < num_actions; ++a) {
      const float q = w.values[a * kPanel + c];
      totals->q += q;
      if (!(q <= totals->most)) totals->most = q;
    }
  }
}

inline std::size_t workspace(const Network& network, int batch_size) {
  return lay_out(network, batch_size, nullptr, nullptr);
}

inline std::size_t values_workspace(const Network& network) {
  return static_cast<std::size_t>(2 * network.widest + network.num_actions + 1) * kPanel;
}

inline void values(const Network& network, const float* params, const float* observations,
                   std::ptrdiff_t count, float* workspace, float* q) {
  const int width = network.num_observations, num_actions = network.num_actions;
  float* const now = workspace;
  float* const next = now + network.widest * kPanel;
  float* const panel_q = next + network.widest * kPanel;
  float* const value = panel_q + num_actions * kPanel;
  Samples samples;
  samples.observation_stride = width;
  for (std::ptrdiff_t first = 0; first < count; first += kPanel) {
    const int live = count - first < kPanel ? static_cast<int>(count - first) : kPanel;
    gather(observations, samples, first, live, width, now);
    look(network, params, now, next, value, panel_q);
    for (int c = 0; c < live; ++c) {
      for (int a = 0; a < num_actions; ++a) q[(first + c) * num_actions + a] = panel_q[a * kPanel + c];
    }
  }
}

inline Metrics update(const Network& network, const Rule& rule, const Learner& learner,
                      const StepSize& step, const Samples& samples, std::ptrdiff_t first,
                      int batch_size, const float* weights, float* block, float* td_error) {
  Workspace w;
  lay_out(network, batch_size, block, &w);
  const int panels = panels_of(batch_size), width = network.num_observations;
  const float* const bootstrap = learner.target ? learner.target : learner.online;
  Totals totals;
  for (int panel = 0; panel < panels; ++panel) {
    const int begin = panel * kPanel;
    const int live = batch_size - begin < kPanel ? batch_size - begin : kPanel;
    gather(samples.o_tm1, samples, first + begin, live, width,
           w.inputs + static_cast<std::ptrdiff_t>(panel) * width * kPanel);
    look_and_keep(network, learner.online, w, panel);
    if (samples.o_t) {
      gather(samples.o_t, samples, first + begin, live, width, w.now);
      look(network, bootstrap, w.now, w.next, w.value, w.values_t);
      if (rule.double_q) {
        gather(samples.o_t, samples, first + begin, live, width, w.now);
        look(network, learner.online, w.now, w.next, w.value, w.selection);
      }
    }
    judge(network, rule, samples, first + begin, live, batch_size,
          weights ? weights + begin : nullptr, w,
          w.advantage_grad + static_cast<std::ptrdiff_t>(panel) * network.num_actions * kPanel,
          td_error + begin, &totals);
    go_back(network, learner.online, w, panel);
  }
  weights_gradient(network, w, panels);
  Metrics metrics;
  metrics.gradient_norm = descend(network, rule, learner, step, w.gradient);
  metrics.loss = static_cast<float>(totals.loss / batch_size);
  metrics.mean_q =
      static_cast<float>(totals.q / (static_cast<double>(batch_size) * network.num_actions));
  metrics.max_q = totals.most;
  return metrics;
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
