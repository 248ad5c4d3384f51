// The values of a Q-network for one observation, with the activations of its hidden layers.
//
// The network is that of the fused updates, and every number is the same chain of operations as
// there. Weights lie transposed, so that a layer's outputs are the lanes, and activation functions
// other than ReLU are added.
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

using kernel::kWidth;
using kernel::Vector;

// A linear layer as rows of its outputs, in whole vectors: the biases, then for each input its
// weights.
class Rows {
 public:
  Rows() = default;
  Rows(const fused::Linear& linear, const float* params)
      : inputs_(linear.in),
        width_(kernel::padded(linear.out)),
        numbers_(static_cast<std::size_t>(linear.in + 1) * static_cast<std::size_t>(width_)) {
    for (int o = 0; o < linear.out; ++o) {
      numbers_[static_cast<std::size_t>(o)] = params[linear.bias + o];
      for (int k = 0; k < linear.in; ++k) {
        const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(k + 1) * width_ + o;
        const std::ptrdiff_t from = linear.weight + static_cast<std::ptrdiff_t>(o) * linear.in + k;
        numbers_[static_cast<std::size_t>(to)] = params[from];
      }
    }
  }

  // out[width] = bias + weight·in.
  void apply(const float* in, float* out) const {
    constexpr int tile = 4;  // vectors, whose sums are independent of each other
    int o = 0;
    for (; o + tile * kWidth <= width_; o += tile * kWidth) apply_to<tile>(in, o, out);
    for (; o < width_; o += kWidth) apply_to<1>(in, o, out);
  }

 private:
  template <int kVectors>
  void apply_to(const float* in, int o, float* out) const {
    const float* row = numbers_.data() + o;
    Vector sums[kVectors];
    for (int v = 0; v < kVectors; ++v) sums[v] = kernel::load(row + v * kWidth);
    for (int k = 0; k < inputs_; ++k) {
      row += width_;
      const Vector factor = kernel::broadcast(in[k]);
      for (int v = 0; v < kVectors; ++v) sums[v] += factor * kernel::load(row + v * kWidth);
    }
    for (int v = 0; v < kVectors; ++v) kernel::store(out + o + v * kWidth, sums[v]);
  }

  int inputs_ = 0;
  int width_ = 0;
  std::vector<float> numbers_;
};

enum class Activation : std::int32_t { kRelu, kTanh, kSilu };

struct Network {
  fused::Network shape;
  Activation activation;
  std::vector<float> params;       // [P], means only
  std::vector<float> observation;  // [D]
  std::vector<float> values;       // [A]
  std::array<Rows, fused::kMaxHidden> hidden;
  Rows value;                                                  // of a dueling head
  Rows advantage;                                              // or the head itself
  std::array<std::vector<float>, fused::kMaxHidden> features;  // of each hidden layer
  std::vector<float> memory;                                   // of `workspace`
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

// Where the parameters, the observation, the values and the features of a hidden layer are.
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

// Takes over the parameters; to be called before the first observation.
TOUCHDOWN_EXPORT(network_load)
void network_load(Network* network) {
  const fused::Network& shape = network->shape;
  const float* const params = network->params.data();
  for (std::size_t i = 0; i < static_cast<std::size_t>(shape.num_hidden); ++i) {
    network->hidden[i] = Rows(shape.hidden[i].linear, params);
  }
  if (shape.dueling) network->value = Rows(shape.value, params);
  network->advantage = Rows(shape.advantage, params);
}

// Q(s,·) of the observation, into the values.
TOUCHDOWN_EXPORT(network_run)
void network_run(Network* network) {
  const fused::Network& shape = network->shape;
  const kernel::FewWorkspace& w = network->workspace;
  const float* const params = network->params.data();
  const float* const end = params + shape.num_weights;
  const float* in = network->observation.data();
  for (std::size_t i = 0; i < static_cast<std::size_t>(shape.num_hidden); ++i) {
    const fused::Hidden& layer = shape.hidden[i];
    const int features = layer.linear.out;
    float* const out = network->features[i].data();
    network->hidden[i].apply(in, out);
    if (shape.layer_norm) {
      kernel::layer_norm_forward(params + layer.gain, params + layer.shift, end, features, 1, out,
                                 0, w.columns);
    }
    for (int f = 0; f < features; ++f) out[f] = activated(network->activation, out[f]);
    in = out;
  }
  network->advantage.apply(in, w.outputs);
  if (shape.dueling) {
    network->value.apply(in, w.state_value);
    kernel::add_state_value(shape, w.state_value, w.outputs);
  }
  kernel::action_values(shape, w, 1, network->values.data());
}

}  // namespace touchdown::web
