// The Python class `Perceptron`, which checks all arguments before anything is written.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "fused/block.hpp"
#include "fused/kernel.hpp"
#include "fused/learning.hpp"
#include "fused/network.hpp"
#include "fused/transition.hpp"

namespace touchdown::fused {

namespace nb = nanobind;

template <typename T, typename... Shape>
using Array = nb::ndarray<T, nb::numpy, nb::device::cpu, nb::c_contig, Shape...>;
template <typename T>
using Vector = Array<T, nb::shape<-1>>;
template <typename T>
using Matrix = Array<T, nb::shape<-1, -1>>;
using Batches = Array<const float, nb::shape<-1, -1, -1>>;
using NoiseTuple = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;
using MetricsTuple = std::tuple<float, float, float, float>;

[[noreturn]] inline void refuse(const std::string& complaint) {
  throw nb::value_error(complaint.c_str());
}

// Refuses an array whose length is not the one expected.
inline void need(std::size_t given, std::size_t wanted, const char* name) {
  if (given == wanted) return;
  refuse(std::string(name) + " has " + std::to_string(given) + " entries, must have " +
         std::to_string(wanted));
}

// The Python class `Perceptron`: a network's shape, with memory to work in. While one thread runs
// updates of an object, updates of it by another thread are refused.
class Perceptron {
 public:
  Perceptron(std::int64_t num_observations, const std::vector<std::int64_t>& hidden_sizes,
             std::int64_t num_actions, bool layer_norm, bool dueling, std::int64_t quantiles,
             std::int64_t atoms, double v_min, double v_max, bool noisy)
      : network_(make_network(num_observations, hidden_sizes, num_actions, layer_norm, dueling,
                              make_prediction(quantiles, atoms, v_min, v_max), noisy)) {}
  Perceptron(const Perceptron&) = delete;
  Perceptron& operator=(const Perceptron&) = delete;

  const Network& network() const { return network_; }
  std::ptrdiff_t num_params() const { return network_.num_params; }

  void values(const Vector<const float>& params, const Matrix<const float>& observations,
              const Matrix<float>& q, const std::optional<NoiseTuple>& noise) const {
    need_noise_only_if_noisy(noise);
    need(params.shape(0), static_cast<std::size_t>(network_.num_params), "params");
    need(observations.shape(1), static_cast<std::size_t>(network_.num_observations),
         "a row of observations");
    need(q.shape(0), observations.shape(0), "q");
    need(q.shape(1), static_cast<std::size_t>(network_.num_actions), "a row of q");
    const float* const from = observations.data();
    const auto count = static_cast<std::ptrdiff_t>(observations.shape(0));
    const float* const at = params.data();
    float* const to = q.data();
    const nb::gil_scoped_release unlocked;
    Block block, sampled;  // not block_: a network may act while it learns
    const float* weights = at;
    if (network_.noisy) {
      std::vector<float> drawn(static_cast<std::size_t>(network_.num_noise));
      if (noise) draw_noise(network_, source_of(*noise).key(), drawn);
      float* const made = sampled.of_size(static_cast<std::size_t>(network_.num_weights));
      kernel().sample_weights(network_, at, noise ? drawn.data() : nullptr, made);
      weights = made;
    }
    kernel().values(network_, weights, from, count,
                    block.of_size(kernel().values_workspace(network_)), to);
  }

  MetricsTuple learn(const Vector<float>& online, const std::optional<Vector<float>>& target,
                     const Vector<float>& mu, const Vector<float>& nu, std::int64_t num_updates,
                     const Vector<const float>& rates, const Batches& packed,
                     const std::optional<Matrix<const float>>& weights,
                     const Matrix<float>& td_error, bool huber, bool double_q, bool sarsa,
                     float reward_scale, float max_grad_norm, float polyak,
                     const std::optional<NoiseTuple>& noise) {
    need_noise_only_if_noisy(noise);
    if (network_.noisy && !noise) refuse("noise = None: must be given for a noisy network");
    const auto fields = transition_fields(static_cast<std::size_t>(network_.num_observations));
    need(packed.shape(2), fields.size, "a transition");
    const Samples samples = packed_samples(packed.data(), network_.num_observations);
    Rule rule;
    rule.huber = huber;
    rule.double_q = double_q;
    rule.sarsa = sarsa;
    rule.reward_scale = reward_scale;
    rule.max_grad_norm = max_grad_norm;
    rule.polyak = polyak;
    if ((double_q || polyak > 0.0f) && !target) refuse("target = None: must be given");
    const std::size_t count = packed.shape(0), batch_size = packed.shape(1);
    for (std::size_t i = 0; i < count * batch_size; ++i) {
      need_action(samples.a_tm1[i * samples.stride]);
      if (sarsa) need_action(samples.a_t[i * samples.stride]);
    }
    return run(online, target, mu, nu, num_updates, rates, count, batch_size, weights, td_error,
               samples, rule, noise ? source_of(*noise) : NoiseSource());
  }

  MetricsTuple fit(const Vector<float>& online, const Vector<float>& mu, const Vector<float>& nu,
                   std::int64_t num_updates, const Vector<const float>& rates,
                   const Matrix<const float>& o_tm1, const Vector<const std::int32_t>& a_tm1,
                   const Vector<const float>& targets, const Matrix<const std::int64_t>& order,
                   const Matrix<float>& td_error, bool huber, float max_grad_norm) {
    if (network_.prediction.kind != Prediction::kMean) {
      refuse("a network that predicts quantiles or atoms: must predict values");
    }
    if (network_.noisy) refuse("a noisy network: must have no noise");
    need(o_tm1.shape(1), static_cast<std::size_t>(network_.num_observations), "a row of o_tm1");
    need(a_tm1.shape(0), o_tm1.shape(0), "a_tm1");
    need(targets.shape(0), o_tm1.shape(0), "targets");
    for (std::size_t i = 0; i < a_tm1.shape(0); ++i) need_action(a_tm1(i));
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::int64_t index = order.data()[i];
      if (index < 0 || index >= static_cast<std::int64_t>(o_tm1.shape(0))) {
        refuse("order: " + std::to_string(index) + ": must be from 0 to " +
               std::to_string(static_cast<std::int64_t>(o_tm1.shape(0)) - 1));
      }
    }
    Samples samples;
    samples.o_tm1 = o_tm1.data();
    samples.a_tm1 = a_tm1.data();
    samples.r_t = targets.data();
    samples.observation_stride = static_cast<std::ptrdiff_t>(o_tm1.shape(1));
    samples.stride = 1;
    samples.order = order.data();
    Rule rule;
    rule.huber = huber;
    rule.max_grad_norm = max_grad_norm;
    return run(online, std::nullopt, mu, nu, num_updates, rates, order.shape(0), order.shape(1),
               std::nullopt, td_error, samples, rule, NoiseSource());
  }

 private:
  static NoiseSource source_of(const NoiseTuple& noise) {
    const auto [seed, purpose, number] = noise;
    return {.seed = seed, .purpose = purpose, .number = number};
  }

  void need_noise_only_if_noisy(const std::optional<NoiseTuple>& noise) const {
    if (noise && !network_.noisy) refuse("noise: must be None for a network that is not noisy");
  }

  void need_action(std::int32_t action) const {
    if (action < 0 || action >= network_.num_actions) {
      refuse("action " + std::to_string(action) + ": must be from 0 to " +
             std::to_string(network_.num_actions - 1));
    }
  }

  MetricsTuple run(const Vector<float>& online, const std::optional<Vector<float>>& target,
                   const Vector<float>& mu, const Vector<float>& nu, std::int64_t num_updates,
                   const Vector<const float>& rates, std::size_t count, std::size_t batch_size,
                   const std::optional<Matrix<const float>>& weights, const Matrix<float>& td_error,
                   const Samples& samples, const Rule& rule, const NoiseSource& noise) {
    const auto size = static_cast<std::size_t>(network_.num_params);
    need(online.shape(0), size, "online");
    if (target) need(target->shape(0), size, "target");
    need(mu.shape(0), size, "mu");
    need(nu.shape(0), size, "nu");
    need(rates.shape(0), count, "rates");
    if (weights) {
      need(weights->shape(0), count, "weights");
      need(weights->shape(1), batch_size, "a row of weights");
    }
    need(td_error.shape(0), count, "td_error");
    need(td_error.shape(1), batch_size, "a row of td_error");
    if (count < 1 || batch_size < 1 || batch_size > kMaxSize) {
      refuse("a minibatch of " + std::to_string(batch_size) + ", " + std::to_string(count) +
             " of them: must be at least 1 each, and at most " + std::to_string(kMaxSize));
    }
    if (num_updates < 0) refuse("num_updates: must be 0 or more");
    if (learning_.test_and_set()) throw std::runtime_error("another thread is learning with it");
    const ClearAtEnd clear{learning_};
    const Learner learner{.online = online.data(),
                          .target = target ? target->data() : nullptr,
                          .mu = mu.data(),
                          .nu = nu.data()};
    const Updates updates{.num_before = num_updates,
                          .count = count,
                          .batch_size = static_cast<int>(batch_size),
                          .rates = rates.data(),
                          .weights = weights ? weights->data() : nullptr,
                          .noise = noise,
                          .td_error = td_error.data()};
    const nb::gil_scoped_release unlocked;
    float* const workspace = block_.of_size(updates_workspace(network_, updates.batch_size));
    const Metrics metrics = run_updates(network_, rule, learner, samples, updates, workspace);
    return {metrics.loss, metrics.mean_q, metrics.max_q, metrics.gradient_norm};
  }

  struct ClearAtEnd {
    std::atomic_flag& flag;
    ~ClearAtEnd() { flag.clear(); }
  };

  Network network_;
  Block block_;
  std::atomic_flag learning_ = ATOMIC_FLAG_INIT;
};

}  // namespace touchdown::fused
