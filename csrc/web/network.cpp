// The values of a Q-network for one observation, with the activations of its hidden layers.
//
// The layers are those of the fused updates; activation functions other than ReLU are added here.
#include "fused/network.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fused/few.hpp"
#include "web/export.hpp"

namespace touchdown::web {
namespace {

namespace kernel = fused::TOUCHDOWN_KERNEL;

enum class Activation : std::int32_t { kRelu, kTanh, kSilu };

struct Network {
  fused::Network shape;
  Activation activation;
  std::vector<float> params;       // [P], means only
  std::vector<float> observation;  // [D]
  std::vector<float> values;       // [A]
  std::array<std::vector<float>, fused::kMaxHidden>
      features;               // of each hidden layer, whole vectors
  std::vector<float> memory;  // of `workspace`
  kernel::FewWorkspace workspace;
};

float activated(Activation activation, float x) {
  switch (activation) {
    case Activation::kTanh:
      return std::tanh(x);
    case Activation::kSilu:
      return x / (1.0f + std::exp(-x));
    case Activation::kRelu:
      break;
  }
  return x < 0.0f ? 0.0f : x;
}

}  // namespace

// All sizes have been checked: the network is one that touchdown.config.sections allows, with at
// most kMaxHidden hidden layers.
TOUCHDOWN_EXPORT(network_new)
Network* network_new(std::int32_t inputs, std::int32_t actions, const std::int32_t* hidden_sizes,
                     std::int32_t num_hidden, std::int32_t activation, bool layer_norm,
                     bool dueling, std::int32_t quantiles, std::int32_t atoms, double v_min,
                     double v_max) {
  std::array<std::int64_t, fused::kMaxHidden> sizes{};
  std::copy_n(hidden_sizes, num_hidden, sizes.begin());
  auto* const network = new Network{};
  network->shape = fused::make_network(
      inputs, std::span(sizes).first(static_cast<std::size_t>(num_hidden)), actions, layer_norm,
      dueling, fused::make_prediction(quantiles, atoms, v_min, v_max));
  const fused::Network& shape = network->shape;
  network->activation = static_cast<Activation>(activation);
  network->params = std::vector<float>(static_cast<std::size_t>(shape.num_params));
  network->observation = std::vector<float>(static_cast<std::size_t>(inputs));
  network->values = std::vector<float>(static_cast<std::size_t>(actions));
  for (int i = 0; i < num_hidden; ++i) {
    network->features[i] =
        std::vector<float>(static_cast<std::size_t>(kernel::padded(shape.hidden[i].linear.out)));
  }
  network->memory = std::vector<float>(kernel::lay_out(shape, nullptr, nullptr));
  kernel::lay_out(shape, network->memory.data(), &network->workspace);
  return network;
}

TOUCHDOWN_EXPORT(network_free)
void network_free(Network* network) { delete network; }

// The number of parameters, and where they, the observation, the values and the features of a
// hidden layer are.
TOUCHDOWN_EXPORT(network_size)
std::size_t network_size(const Network* network) { return network->params.size(); }

TOUCHDOWN_EXPORT(network_params)
float* network_params(Network* network) { return network->params.data(); }

TOUCHDOWN_EXPORT(network_observation)
float* network_observation(Network* network) { return network->observation.data(); }

TOUCHDOWN_EXPORT(network_values)
float* network_values(Network* network) { return network->values.data(); }

TOUCHDOWN_EXPORT(network_features)
float* network_features(Network* network, std::int32_t layer) {
  return network->features[static_cast<std::size_t>(layer)].data();
}

// Q(s,·) of the observation, into the values.
TOUCHDOWN_EXPORT(network_run)
void network_run(Network* network) {
  const fused::Network& shape = network->shape;
  const kernel::FewWorkspace& w = network->workspace;
  const float* const params = network->params.data();
  const float* const end = params + shape.num_weights;
  const float* in = network->observation.data();
  for (int i = 0; i < shape.num_hidden; ++i) {
    const fused::Hidden& layer = shape.hidden[i];
    const int features = layer.linear.out;
    float* const out = network->features[static_cast<std::size_t>(i)].data();
    kernel::linear_forward(layer.linear, params, end, in, 0, 1, out, 0);
    if (shape.layer_norm) {
      kernel::layer_norm_forward(params + layer.gain, params + layer.shift, end, features, 1, out,
                                 0, w.columns);
    }
    for (int f = 0; f < features; ++f) out[f] = activated(network->activation, out[f]);
    in = out;
  }
  kernel::linear_forward(shape.advantage, params, end, in, 0, 1, w.outputs, 0);
  if (shape.dueling) {
    kernel::linear_forward(shape.value, params, end, in, 0, 1, w.state_value, 0);
    kernel::add_state_value(shape, w.state_value, w.outputs);
  }
  kernel::action_values(shape, w, 1, network->values.data());
}

}  // namespace touchdown::web
