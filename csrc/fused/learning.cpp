#include "fused/learning.hpp"

#include <cmath>
#include <span>
#include <vector>

#include "fused/kernel.hpp"
#include "fused/transition.hpp"
#include "simd/flush_denormals.hpp"

namespace touchdown::fused {

Samples packed_samples(const float* transitions, int num_observations) {
  const TransitionFields fields = transition_fields(static_cast<std::size_t>(num_observations));
  Samples samples;
  samples.o_tm1 = transitions + fields.o_tm1;
  samples.a_tm1 = reinterpret_cast<const std::int32_t*>(transitions + fields.a_tm1);
  samples.r_t = transitions + fields.r_t;
  samples.discount_t = transitions + fields.discount_t;
  samples.a_t = reinterpret_cast<const std::int32_t*>(transitions + fields.a_t);
  samples.o_t = transitions + fields.o_t;
  samples.stride = samples.observation_stride = static_cast<std::ptrdiff_t>(fields.size);
  return samples;
}

StepSize step_size(const Rule& rule, float rate, double t) {
  StepSize step;
  step.rate = rate;
  // Powers are taken in double precision: in single, 1 − β₂ᵗ loses digits.
  step.correction1 = static_cast<float>(1.0 - std::pow(static_cast<double>(rule.b1), t));
  step.correction2 = static_cast<float>(1.0 - std::pow(static_cast<double>(rule.b2), t));
  return step;
}

std::size_t updates_workspace(const Network& network, int batch_size) {
  return kernel().update_workspace(network, batch_size);
}

Metrics run_updates(const Network& network, const Rule& rule, const Learner& learner,
                    const Samples& samples, const Updates& updates, float* workspace) {
  const simd::FlushDenormals flush;
  Metrics metrics;
  const auto num_noise = static_cast<std::size_t>(network.num_noise);
  std::vector<float> noise(3 * num_noise);
  for (std::size_t k = 0; k < updates.count; ++k) {
    const double t = static_cast<double>(updates.num_before) + static_cast<double>(k) + 1.0;
    const auto first = static_cast<std::ptrdiff_t>(k) * updates.batch_size;
    if (network.noisy) {
      NoiseSource source = updates.noise;
      source.number += static_cast<std::uint32_t>(k);
      const std::size_t passes = rule.double_q ? 3 : 2;
      for (std::size_t i = 0; i < passes; ++i) {
        draw_noise(network, derived(source.key(), i),
                   std::span(noise).subspan(i * num_noise, num_noise));
      }
    }
    metrics = kernel().update(network, rule, learner, step_size(rule, updates.rates[k], t), samples,
                              first, updates.batch_size,
                              updates.weights ? updates.weights + first : nullptr, noise.data(),
                              workspace, updates.td_error + first);
  }
  return metrics;
}

}  // namespace touchdown::fused
