// Noisy linear layers: w = µ + σ⊙noise (Fortunato et al., 2018, Eq. 9-11). A sample of the weights
// is a plain network, which everything else computes with.
#pragma once

#include <algorithm>
#include <cstddef>

#include "fused/network.hpp"
#include "simd/kernel_target.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

// Calls `linear(layer, plain, learned, noise)` for each linear layer, with the offsets of its
// parameters in a plain network and in the noisy one, where σ follows µ, and of its noise; and
// `other(plain, learned, count)` for the parameters that have no noise.
template <typename OnLinear, typename OnOther>
inline void for_each_part(const Network& network, const OnLinear& linear, const OnOther& other) {
  std::ptrdiff_t plain = 0, learned = 0, noise = 0;
  const auto visit = [&](const Linear& layer) {
    const std::ptrdiff_t size = static_cast<std::ptrdiff_t>(layer.in + 1) * layer.out;
    linear(layer, plain, learned, noise);
    plain += size;
    learned += 2 * size;
    noise += layer.out + layer.in;
  };
  for (int i = 0; i < network.num_hidden; ++i) {
    visit(network.hidden[i].linear);
    if (!network.layer_norm) continue;
    const std::ptrdiff_t count = 2 * static_cast<std::ptrdiff_t>(network.hidden[i].linear.out);
    other(plain, learned, count);
    plain += count;
    learned += count;
  }
  if (network.dueling) visit(network.value);
  visit(network.advantage);
}

// The plain network [P] that a sample of noise makes; without noise, that of the means.
inline void sample_weights(const Network& network, const float* params, const float* noise,
                           float* sampled) {
  for_each_part(
      network,
      [&](const Linear& layer, std::ptrdiff_t plain, std::ptrdiff_t learned, std::ptrdiff_t at) {
        const std::ptrdiff_t weights = static_cast<std::ptrdiff_t>(layer.in) * layer.out;
        const float* __restrict const mean = params + learned;
        const float* __restrict const sigma = mean + weights + layer.out;
        float* __restrict const to = sampled + plain;
        if (!noise) {
          std::copy_n(mean, weights + layer.out, to);
          return;
        }
        const float *const after = noise + at, *const before = after + layer.out;
        for (int o = 0; o < layer.out; ++o) {
          const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(o) * layer.in;
          for (int i = 0; i < layer.in; ++i) {
            to[row + i] = mean[row + i] + sigma[row + i] * (after[o] * before[i]);
          }
          to[weights + o] = mean[weights + o] + sigma[weights + o] * after[o];
        }
      },
      [&](std::ptrdiff_t plain, std::ptrdiff_t learned, std::ptrdiff_t count) {
        std::copy_n(params + learned, count, sampled + plain);
      });
}

// The gradient with respect to all that is learned, µ and σ, from that of the sampled weights.
inline void noisy_gradient(const Network& network, const float* sampled, const float* noise,
                           float* gradient) {
  for_each_part(
      network,
      [&](const Linear& layer, std::ptrdiff_t plain, std::ptrdiff_t learned, std::ptrdiff_t at) {
        const std::ptrdiff_t weights = static_cast<std::ptrdiff_t>(layer.in) * layer.out;
        const float* __restrict const from = sampled + plain;
        float* __restrict const of_sigma = gradient + learned + weights + layer.out;
        const float *const after = noise + at, *const before = after + layer.out;
        std::copy_n(from, weights + layer.out, gradient + learned);
        for (int o = 0; o < layer.out; ++o) {
          const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(o) * layer.in;
          for (int i = 0; i < layer.in; ++i) {
            of_sigma[row + i] = from[row + i] * (after[o] * before[i]);
          }
          of_sigma[weights + o] = from[weights + o] * after[o];
        }
      },
      [&](std::ptrdiff_t plain, std::ptrdiff_t learned, std::ptrdiff_t count) {
        std::copy_n(sampled + plain, count, gradient + learned);
      });
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
