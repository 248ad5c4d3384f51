// The kernel: values and updates of a Q-network with no call to a library in between. It is
// compiled once per instruction set (see simd/kernel_target.hpp).
//
// An update is deep Q-learning's step as touchdown's JAX learner has it, its slow twin in the
// tests. The minibatch goes through in panels of samples that stay in the first-level cache; only
// the parameters' gradient is taken over all of them at once.
#include <algorithm>
#include <cstddef>

#include "fused/backward.hpp"
#include "fused/distribution_error.hpp"
#include "fused/few.hpp"
#include "fused/forward.hpp"
#include "fused/kernel.hpp"
#include "fused/learning.hpp"
#include "fused/network.hpp"
#include "fused/noisy.hpp"
#include "fused/normals.hpp"
#include "fused/optimizer.hpp"
#include "fused/panels.hpp"
#include "fused/prediction.hpp"
#include "fused/td_error.hpp"
#include "fused/workspace.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {
namespace {

std::size_t update_workspace(const Network& network, int batch_size) {
  return lay_out(network, batch_size, nullptr, nullptr);
}

std::size_t values_workspace(const Network& network) {
  const int features =
      2 * network.widest + network.advantage.out + network.num_actions + network.prediction.outputs;
  return std::max(static_cast<std::size_t>(features) * kPanel, lay_out(network, nullptr, nullptr));
}

void values(const Network& network, const float* params, const float* observations,
            std::ptrdiff_t count, float* workspace, float* q) {
  const int num_observations = network.num_observations, num_actions = network.num_actions;
  float* const in = workspace;
  float* const out = in + network.widest * kPanel;
  float* const outputs = out + network.widest * kPanel;
  float* const state_value = outputs + network.advantage.out * kPanel;
  const bool means = network.prediction.kind == Prediction::kMean;
  float* const panel_q = means ? outputs : state_value + network.prediction.outputs * kPanel;
  Samples samples;
  samples.observation_stride = num_observations;
  for (std::ptrdiff_t first = 0; first < count; first += kPanel) {
    const int live = count - first < kPanel ? static_cast<int>(count - first) : kPanel;
    if (live <= kFew) {
      few_values(network, params, observations + first * num_observations, live, workspace,
                 q + first * num_actions);
      break;
    }
    gather(observations, samples, first, live, num_observations, in, nullptr);
    forward(network, params, in, out, state_value, outputs);
    action_values(network, outputs, panel_q);
    for (int c = 0; c < live; ++c) {
      for (int a = 0; a < num_actions; ++a) {
        q[(first + c) * num_actions + a] = panel_q[a * kPanel + c];
      }
    }
  }
}

Metrics update(const Network& network, const Rule& rule, const Learner& learner,
               const StepSize& step, const Samples& samples, std::ptrdiff_t first, int batch_size,
               const float* weights, const float* noise, float* block, float* td_error) {
  Workspace w;
  lay_out(network, batch_size, block, &w);
  const int panels = num_panels(batch_size), num_observations = network.num_observations;
  const float* online = learner.online;
  const float* bootstrap = learner.target ? learner.target : learner.online;
  const float* selector = learner.online;
  if (network.noisy) {
    sample_weights(network, online, noise, w.sampled[0]);
    sample_weights(network, bootstrap, noise + network.num_noise, w.sampled[1]);
    if (rule.double_q) {
      sample_weights(network, selector, noise + 2 * network.num_noise, w.sampled[2]);
    }
    online = w.sampled[0], bootstrap = w.sampled[1], selector = w.sampled[2];
  }
  const auto errors =
      network.prediction.kind == Prediction::kMean ? &td_errors : &distribution_errors;
  Totals totals;
  for (int panel = 0; panel < panels; ++panel) {
    const int begin = panel * kPanel;
    const int live = batch_size - begin < kPanel ? batch_size - begin : kPanel;
    gather(samples.o_tm1, samples, first + begin, live, num_observations, w.inputs,
           w.input_samples + begin * padded(num_observations));
    forward_storing_activations(network, online, w, panel);
    if (samples.o_t) {
      gather(samples.o_t, samples, first + begin, live, num_observations, w.scratch[0], nullptr);
      forward(network, bootstrap, w.scratch[0], w.scratch[1], w.state_value, w.outputs_t);
      action_values(network, w.outputs_t, w.q_t);
      if (rule.double_q) {
        gather(samples.o_t, samples, first + begin, live, num_observations, w.scratch[0], nullptr);
        forward(network, selector, w.scratch[0], w.scratch[1], w.state_value, w.outputs_selector);
        action_values(network, w.outputs_selector, w.q_t_selector);
      }
    }
    errors(network, rule, samples, first + begin, live, batch_size,
           weights ? weights + begin : nullptr, w,
           w.advantage_grad + static_cast<std::ptrdiff_t>(panel) * network.advantage.out * kPanel,
           td_error + begin, &totals);
    backward(network, online, w, panel);
  }
  parameter_gradient(network, w, panels);
  if (network.noisy) noisy_gradient(network, w.gradient, noise, w.learned_gradient);

  Metrics metrics;
  metrics.gradient_norm = global_norm(w.learned_gradient, network.num_params);
  adam_step(rule, learner, step, w.learned_gradient,
            clipping_factor(metrics.gradient_norm, rule.max_grad_norm), network.num_params);
  if (rule.polyak > 0.0f) soft_update(rule.polyak, learner, network.num_params);
  metrics.loss = static_cast<float>(totals.loss / batch_size);
  metrics.mean_q =
      static_cast<float>(totals.q / (static_cast<double>(batch_size) * network.num_actions));
  metrics.max_q = totals.max_q;
  return metrics;
}

}  // namespace

extern const NetworkKernel kKernel{&update_workspace, &values_workspace, &values,
                                   &sample_weights,   &scaled_normals,   &update};

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
