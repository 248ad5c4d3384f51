// The fused kernel: values and updates of a Q-network, compiled once per instruction set.
#pragma once

#include <cstddef>

#include "fused/learning.hpp"
#include "fused/network.hpp"
#include "fused/noise.hpp"
#include "simd/instruction_set.hpp"

namespace touchdown::fused {

struct NetworkKernel {
  // The number of floats that `update` needs to work in, for minibatches of `batch_size`.
  std::size_t (*update_workspace)(const Network& network, int batch_size);
  // The number of floats that `values` needs to work in.
  std::size_t (*values_workspace)(const Network& network);
  // Q(s,·) of `count` observations [count][D] into q [count][A]. `params` of a noisy network are
  // those that `sample_weights` gave.
  void (*values)(const Network& network, const float* params, const float* observations,
                 std::ptrdiff_t count, float* workspace, float* q);
  // The weights that a sample of noise [num_noise] gives a noisy network; null: their means.
  void (*sample_weights)(const Network& network, const float* params, const float* noise,
                         float* sampled);
  // f(ε) = sgn(ε)·√|ε| of `count` normal numbers, those that `jax.random.normal` draws.
  void (*scaled_normals)(Key key, std::size_t count, float* scaled);
  // One update from the samples `first` to `first + batch_size`; writes their TD errors. `noise` of
  // a noisy network is a sample each for Q(s,·), for the network that bootstraps and, with double
  // Q-learning, for the selection.
  Metrics (*update)(const Network& network, const Rule& rule, const Learner& learner,
                    const StepSize& step, const Samples& samples, std::ptrdiff_t first,
                    int batch_size, const float* weights, const float* noise, float* workspace,
                    float* td_error);
};

const NetworkKernel& kernel(simd::InstructionSet set);  // `set` must be available
const NetworkKernel& kernel();                          // of the instruction set that is chosen

}  // namespace touchdown::fused
