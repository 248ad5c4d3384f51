#include "fused/network.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace touchdown::fused {
namespace {

int checked_size(std::int64_t size, const char* name) {
  if (size < 1 || size > kMaxSize) {
    throw std::invalid_argument(std::string(name) + " = " + std::to_string(size) +
                                ": must be from 1 to " + std::to_string(kMaxSize));
  }
  return static_cast<int>(size);
}

}  // namespace

Prediction make_prediction(std::int64_t quantiles, std::int64_t atoms, double v_min, double v_max) {
  if (quantiles != 0 && atoms != 0) {
    throw std::invalid_argument("atoms = " + std::to_string(atoms) +
                                ": must be 0 with quantiles = " + std::to_string(quantiles));
  }
  Prediction prediction;
  if (quantiles != 0) {
    prediction.kind = Prediction::kQuantiles;
    prediction.outputs = checked_size(quantiles, "quantiles");
  } else if (atoms != 0) {
    prediction.kind = Prediction::kAtoms;
    prediction.outputs = checked_size(atoms, "atoms");
    prediction.v_min = static_cast<float>(v_min);
    prediction.v_max = static_cast<float>(v_max);
    if (atoms < 2) throw std::invalid_argument("atoms = 1: must be at least 2");
    if (!(prediction.v_min < prediction.v_max)) {
      throw std::invalid_argument("v_min = " + std::to_string(v_min) +
                                  ": must be below v_max = " + std::to_string(v_max));
    }
  }
  return prediction;
}

Network make_network(std::int64_t num_observations, std::span<const std::int64_t> hidden_sizes,
                     std::int64_t num_actions, bool layer_norm, bool dueling,
                     const Prediction& prediction, bool noisy) {
  if (hidden_sizes.size() > static_cast<std::size_t>(kMaxHidden)) {
    throw std::invalid_argument("hidden_sizes has " + std::to_string(hidden_sizes.size()) +
                                " layers, must have at most " + std::to_string(kMaxHidden));
  }
  Network network;
  network.num_observations = checked_size(num_observations, "num_observations");
  network.num_actions = checked_size(num_actions, "num_actions");
  network.num_hidden = static_cast<int>(hidden_sizes.size());
  network.layer_norm = layer_norm;
  network.dueling = dueling;
  network.prediction = prediction;
  network.noisy = noisy;
  std::ptrdiff_t offset = 0, num_sigmas = 0;
  const auto linear = [&](int in, int out) {
    Linear layer;
    layer.in = in;
    layer.out = out;
    layer.weight = offset;
    layer.bias = offset + static_cast<std::ptrdiff_t>(in) * out;
    offset = layer.bias + out;
    if (noisy) {
      num_sigmas += offset - layer.weight;
      network.num_noise += in + out;
    }
    return layer;
  };
  int in = network.num_observations;
  network.widest = std::max(in, network.num_actions);
  for (int i = 0; i < network.num_hidden; ++i) {
    const int out = checked_size(hidden_sizes[static_cast<std::size_t>(i)], "hidden_sizes");
    Hidden& layer = network.hidden[i];
    layer.linear = linear(in, out);
    if (layer_norm) {
      layer.gain = offset;
      layer.shift = offset + out;
      offset += 2 * static_cast<std::ptrdiff_t>(out);
    }
    in = out;
    network.widest = std::max(network.widest, in);
  }
  const int outputs = checked_size(num_actions * prediction.outputs, "outputs");
  if (dueling) network.value = linear(in, prediction.outputs);
  network.advantage = linear(in, outputs);
  network.num_weights = offset;
  network.num_params = offset + num_sigmas;
  return network;
}

}  // namespace touchdown::fused
