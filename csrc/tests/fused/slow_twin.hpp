// The slow twin of the fused kernel: plain loops in double precision, one sample at a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "fused/learning.hpp"
#include "fused/network.hpp"

namespace touchdown::fused {

using Doubles = std::vector<double>;

inline Doubles slow_linear(const Linear& linear, const Doubles& params, const Doubles& in) {
  Doubles out(static_cast<std::size_t>(linear.out));
  for (int o = 0; o < linear.out; ++o) {
    double sum = params[static_cast<std::size_t>(linear.bias + o)];
    for (int i = 0; i < linear.in; ++i) {
      sum += params[static_cast<std::size_t>(linear.weight + o * linear.in + i)] *
             in[static_cast<std::size_t>(i)];
    }
    out[static_cast<std::size_t>(o)] = sum;
  }
  return out;
}

inline double mean_of(const Doubles& numbers) {
  double sum = 0.0;
  for (const double number : numbers) sum += number;
  return sum / static_cast<double>(numbers.size());
}

// The outputs of one observation, [A·Z].
inline Doubles slow_outputs(const Network& network, const Doubles& params, Doubles x) {
  for (int i = 0; i < network.num_hidden; ++i) {
    const Hidden& layer = network.hidden[i];
    x = slow_linear(layer.linear, params, x);
    if (network.layer_norm) {
      const double mean = mean_of(x);
      double variance = 0.0;
      for (const double each : x) variance += (each - mean) * (each - mean);
      const double sigma = std::sqrt(variance / static_cast<double>(x.size()) + 1e-5);
      for (std::size_t f = 0; f < x.size(); ++f) {
        x[f] = params[static_cast<std::size_t>(layer.gain) + f] * (x[f] - mean) / sigma +
               params[static_cast<std::size_t>(layer.shift) + f];
      }
    }
    for (double& each : x) each = std::max(each, 0.0);
  }
  Doubles outputs = slow_linear(network.advantage, params, x);
  if (network.dueling) {
    const Doubles value = slow_linear(network.value, params, x);
    for (std::size_t z = 0; z < value.size(); ++z) {
      Doubles of_each;
      for (std::size_t i = z; i < outputs.size(); i += value.size()) of_each.push_back(outputs[i]);
      const double mean = mean_of(of_each);
      for (std::size_t i = z; i < outputs.size(); i += value.size()) outputs[i] += value[z] - mean;
    }
  }
  return outputs;
}

// The outputs of one action, [Z].
inline Doubles of_action(const Network& network, const Doubles& outputs, std::ptrdiff_t action) {
  const std::ptrdiff_t each = network.prediction.outputs;
  return {outputs.begin() + action * each, outputs.begin() + (action + 1) * each};
}

inline Doubles slow_softmax(const Doubles& logits) {
  double total = 0.0;
  for (const double logit : logits) total += std::exp(logit);
  Doubles probabilities;
  for (const double logit : logits) probabilities.push_back(std::exp(logit) / total);
  return probabilities;
}

// The return of an atom.
inline double slow_atom(const Prediction& prediction, std::size_t i) {
  const double share = static_cast<double>(i) / (prediction.outputs - 1);
  return prediction.v_min + share * (static_cast<double>(prediction.v_max) - prediction.v_min);
}

inline double slow_mean(const Prediction& prediction, const Doubles& probabilities) {
  double mean = 0.0;
  for (std::size_t i = 0; i < probabilities.size(); ++i) {
    mean += probabilities[i] * slow_atom(prediction, i);
  }
  return mean;
}

// Q(s,·) of one observation.
inline Doubles slow_values(const Network& network, const Doubles& params, const Doubles& x) {
  const Doubles outputs = slow_outputs(network, params, x);
  Doubles q;
  for (int a = 0; a < network.num_actions; ++a) {
    const Doubles own = of_action(network, outputs, a);
    q.push_back(network.prediction.kind == Prediction::kAtoms
                    ? slow_mean(network.prediction, slow_softmax(own))
                    : mean_of(own));
  }
  return q;
}

// Random transitions of `network`'s sizes, field by field.
struct RandomBatch {
  RandomBatch(const Network& network, std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    std::uniform_int_distribution<std::int32_t> action(0, network.num_actions - 1);
    const auto d = static_cast<std::size_t>(network.num_observations);
    for (std::size_t i = 0; i < count * d; ++i) {
      o_tm1.push_back(normal(random));
      o_t.push_back(normal(random));
    }
    for (std::size_t i = 0; i < count; ++i) {
      a_tm1.push_back(action(random));
      a_t.push_back(action(random));
      r_t.push_back(normal(random));
      discount_t.push_back(i % 3 == 0 ? 0.0f : 0.9f);
    }
    samples.o_tm1 = o_tm1.data();
    samples.a_tm1 = a_tm1.data();
    samples.r_t = r_t.data();
    samples.discount_t = discount_t.data();
    samples.o_t = o_t.data();
    samples.a_t = a_t.data();
    samples.observation_stride = network.num_observations;
    samples.stride = 1;
  }

  std::vector<float> o_tm1, o_t, r_t, discount_t;
  std::vector<std::int32_t> a_tm1, a_t;
  Samples samples;
};

inline std::vector<float> random_params(const Network& network, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0.0f, 0.5f);
  std::vector<float> params(static_cast<std::size_t>(network.num_params));
  for (float& param : params) param = normal(random);
  return params;
}

inline Doubles observation_of(const std::vector<float>& observations, const Network& network,
                              std::size_t index) {
  const auto d = static_cast<std::size_t>(network.num_observations);
  const auto begin = observations.begin() + static_cast<std::ptrdiff_t>(index * d);
  return {begin, begin + static_cast<std::ptrdiff_t>(d)};
}

inline std::vector<std::pair<const char*, Network>> networks() {
  const auto make = [](const std::vector<std::int64_t>& hidden, bool layer_norm, bool dueling,
                       const Prediction& prediction = {}) {
    return make_network(5, hidden, 3, layer_norm, dueling, prediction);
  };
  const Prediction quantiles = make_prediction(7, 0, 0.0, 0.0);
  const Prediction atoms = make_prediction(0, 11, -1.5, 2.5);
  return {{"linear", make({}, false, false)},
          {"one layer", make({7}, false, false)},
          {"wider than a panel", make({33, 17}, false, false)},
          {"normalised", make({16, 8}, true, false)},
          {"dueling", make({16, 9}, false, true)},
          {"dueling without a hidden layer", make({}, false, true)},
          {"normalised and dueling", make({13}, true, true)},
          {"quantiles", make({9}, false, false, quantiles)},
          {"one quantile", make({}, false, false, make_prediction(1, 0, 0.0, 0.0))},
          {"quantiles, dueling", make({13}, true, true, quantiles)},
          {"atoms", make({9}, false, false, atoms)},
          {"more atoms than a panel has samples",
           make({3}, false, false, make_prediction(0, 51, -3.0, 3.0))},
          {"atoms, dueling", make({13}, true, true, atoms)}};
}

}  // namespace touchdown::fused
