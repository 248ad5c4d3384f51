// The optimizer: gradient clipping, Adam's step, and the soft update of the target network.
#pragma once

#include <cmath>
#include <cstddef>

#include "fused/learning.hpp"
#include "fused/vector.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

// The Euclidean norm of the whole gradient.
inline float global_norm(const float* gradient, std::ptrdiff_t count) {
  Vector squares{};
  std::ptrdiff_t i = 0;
  for (; i + kWidth <= count; i += kWidth) {
    const Vector g = load(gradient + i);
    squares += g * g;
  }
  float square = sum(squares);
  for (; i < count; ++i) square += gradient[i] * gradient[i];
  return std::sqrt(square);
}

// Gradient clipping by the global norm: the factor that the gradient is multiplied with. No
// maximum, 0, means no clipping.
inline float clipping_factor(float norm, float max_norm) {
  const bool clips = max_norm > 0.0f && !(norm < max_norm);
  return clips ? max_norm / norm : 1.0f;
}

// Adam's step (Kingma & Ba, 2015) along `factor`·gradient.
inline void adam_step(const Rule& rule, const Learner& learner, const StepSize& step,
                      const float* gradient, float factor, std::ptrdiff_t count) {
  const float scale1 = 1.0f / step.correction1, scale2 = 1.0f / step.correction2;
  // Copies without aliases: otherwise the loop is not vectorised.
  const float b1 = rule.b1, b2 = rule.b2, epsilon = rule.epsilon, rate = step.rate;
  float* __restrict const online = learner.online;
  float* __restrict const mu = learner.mu;
  float* __restrict const nu = learner.nu;
  const float* __restrict const slope = gradient;
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    const float g = slope[i] * factor;
    const float m = b1 * mu[i] + (1.0f - b1) * g;
    const float v = b2 * nu[i] + (1.0f - b2) * (g * g);
    mu[i] = m;
    nu[i] = v;
    online[i] -= rate * (m * scale1) / (std::sqrt(v * scale2) + epsilon);
  }
}

// target += polyak·(online − target)   (Lillicrap et al., 2016)
inline void soft_update(float polyak, const Learner& learner, std::ptrdiff_t count) {
  const float* __restrict const online = learner.online;
  float* __restrict const target = learner.target;
  for (std::ptrdiff_t i = 0; i < count; ++i) target[i] += polyak * (online[i] - target[i]);
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
