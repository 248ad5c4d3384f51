#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "network.hpp"

namespace nb = nanobind;
using namespace nanobind::literals;

namespace touchdown::fused {
namespace {

template <typename T, typename... Shape>
using Array = nb::ndarray<T, nb::numpy, nb::device::cpu, nb::c_contig, Shape...>;
template <typename T>
using Vector = Array<T, nb::shape<-1>>;
template <typename T>
using Matrix = Array<T, nb::shape<-1, -1>>;
using Batches = Array<const float, nb::shape<-1, -1, -1>>;
using MetricsTuple = std::tuple<float, float, float, float>;

constexpr std::int64_t kMostSize = 1 << 20;  // of a layer

[[noreturn]] void refuse(const std::string& complaint) { throw nb::value_error(complaint.c_str()); }

void need(std::size_t given, std::size_t wanted, const char* name) {
  if (given == wanted) return;
  refuse(std::string(name) + " has " + std::to_string(given) + " entries, must have " +
         std::to_string(wanted));
}

// Memory that begins on a cache line.
class Block {
 public:
  float* of(std::size_t floats) {
    if (memory_.size() < floats + kLine) memory_.resize(floats + kLine);
    const auto address = reinterpret_cast<std::uintptr_t>(memory_.data());
    return memory_.data() + (64 - address % 64) % 64 / sizeof(float);
  }

 private:
  static constexpr std::size_t kLine = 16;
  std::vector<float> memory_;
};

int checked_size(std::int64_t size, const char* name) {
  if (size < 1 || size > kMostSize) {
    refuse(std::string(name) + " = " + std::to_string(size) + ": must be from 1 to " +
           std::to_string(kMostSize));
  }
  return static_cast<int>(size);
}

// Parameters in the order of touchdown.agents.networks: a layer's weight, its bias, then its
// normalisation's; of a dueling head the value's before the advantages'.
Network make_network(std::int64_t num_observations, const std::vector<std::int64_t>& hidden_sizes,
                     std::int64_t num_actions, bool layer_norm, bool dueling) {
  if (hidden_sizes.size() > static_cast<std::size_t>(kMostHidden)) {
    refuse("hidden_sizes has " + std::to_string(hidden_sizes.size()) + " layers, must have at most " +
           std::to_string(kMostHidden));
  }
  Network network;
  network.num_observations = checked_size(num_observations, "num_observations");
  network.num_actions = checked_size(num_actions, "num_actions");
  network.num_hidden = static_cast<int>(hidden_sizes.size());
  network.layer_norm = layer_norm;
  network.dueling = dueling;
  std::ptrdiff_t at = 0;
  const auto linear = [&](int in, int out) {
    Linear layer;
    layer.in = in;
    layer.out = out;
    layer.weight = at;
    layer.bias = at + static_cast<std::ptrdiff_t>(in) * out;
    at = layer.bias + out;
    return layer;
  };
  int in = network.num_observations;
  network.widest = std::max(in, network.num_actions);
  for (int i = 0; i < network.num_hidden; ++i) {
    const int out = checked_size(hidden_sizes[i], "hidden_sizes");
    Hidden& layer = network.hidden[i];
    layer.linear = linear(in, out);
    if (layer_norm) {
      layer.gain = at;
      layer.shift = at + out;
      at += 2 * static_cast<std::ptrdiff_t>(out);
    }
    in = out;
    network.widest = std::max(network.widest, in);
  }
  if (dueling) network.value = linear(in, 1);
  network.advantage = linear(in, network.num_actions);
  network.num_params = at;
  return network;
}

// A network's shape with memory to work in. Of one at a time: updates of one object are refused
// while another thread is at them.
class Perceptron {
 public:
  Perceptron(std::int64_t num_observations, const std::vector<std::int64_t>& hidden_sizes,
             std::int64_t num_actions, bool layer_norm, bool dueling)
      : network_(make_network(num_observations, hidden_sizes, num_actions, layer_norm, dueling)) {}
  Perceptron(const Perceptron&) = delete;
  Perceptron& operator=(const Perceptron&) = delete;

  std::ptrdiff_t num_params() const { return network_.num_params; }

  void values(const Vector<const float>& params, const Matrix<const float>& observations,
              const Matrix<float>& q) const {
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
    Block block;  // its own: worlds are flown while the same network learns
    kernel().values(network_, at, from, count, block.of(kernel().values_workspace(network_)), to);
  }

  MetricsTuple learn(const Vector<float>& online, const std::optional<Vector<float>>& target,
                     const Vector<float>& mu, const Vector<float>& nu, std::int64_t num_updates,
                     const Vector<const float>& rates, const Batches& words,
                     const std::optional<Matrix<const float>>& weights,
                     const Matrix<float>& td_error, bool huber, bool double_q, bool sarsa,
                     float reward_scale, float max_grad_norm, float polyak) {
    const std::size_t width = static_cast<std::size_t>(network_.num_observations);
    need(words.shape(2), 2 * width + 5, "a record");
    Samples samples;
    samples.o_tm1 = words.data();
    samples.a_tm1 = reinterpret_cast<const std::int32_t*>(words.data() + width);
    samples.r_t = words.data() + width + 1;
    samples.discount_t = words.data() + width + 2;
    samples.a_t = reinterpret_cast<const std::int32_t*>(words.data() + width + 4);
    samples.o_t = words.data() + width + 5;
    samples.stride = samples.observation_stride = static_cast<std::ptrdiff_t>(words.shape(2));
    Rule rule;
    rule.huber = huber;
    rule.double_q = double_q;
    rule.sarsa = sarsa;
    rule.reward_scale = reward_scale;
    rule.max_grad_norm = max_grad_norm;
    rule.polyak = polyak;
    if ((double_q || polyak > 0.0f) && !target) refuse("target = None: must be given");
    const std::size_t count = words.shape(0), batch_size = words.shape(1);
    for (std::size_t i = 0; i < count * batch_size; ++i) {
      need_action(samples.a_tm1[i * samples.stride]);
      if (sarsa) need_action(samples.a_t[i * samples.stride]);
    }
    return run(online, target, mu, nu, num_updates, rates, count, batch_size, weights, td_error,
               samples, rule);
  }

  MetricsTuple fit(const Vector<float>& online, const Vector<float>& mu, const Vector<float>& nu,
                   std::int64_t num_updates, const Vector<const float>& rates,
                   const Matrix<const float>& o_tm1, const Vector<const std::int32_t>& a_tm1,
                   const Vector<const float>& targets, const Matrix<const std::int64_t>& order,
                   const Matrix<float>& td_error, bool huber, float max_grad_norm) {
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
               std::nullopt, td_error, samples, rule);
  }

 private:
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
                   const Samples& samples, const Rule& rule) {
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
    if (count < 1 || batch_size < 1 || batch_size > kMostSize) {
      refuse("a minibatch of " + std::to_string(batch_size) + ", " + std::to_string(count) +
             " of them: must be at least 1 each, and at most " + std::to_string(kMostSize));
    }
    if (num_updates < 0) refuse("num_updates: must be 0 or more");
    if (learning_.test_and_set()) throw std::runtime_error("another thread is learning with it");
    const Finally rest{learning_};
    Learner learner;
    learner.online = online.data();
    learner.target = target ? target->data() : nullptr;
    learner.mu = mu.data();
    learner.nu = nu.data();
    const float* const rate = rates.data();
    const float* const weight = weights ? weights->data() : nullptr;
    float* const errors = td_error.data();
    const int batch = static_cast<int>(batch_size);
    const nb::gil_scoped_release unlocked;
    float* const workspace = block_.of(kernel().workspace(network_, batch));
    Metrics metrics;
    for (std::size_t k = 0; k < count; ++k) {
      const double updates = static_cast<double>(num_updates) + static_cast<double>(k) + 1.0;
      StepSize step;
      step.rate = rate[k];
      step.correction1 = static_cast<float>(1.0 - std::pow(static_cast<double>(rule.b1), updates));
      step.correction2 = static_cast<float>(1.0 - std::pow(static_cast<double>(rule.b2), updates));
      const auto first = static_cast<std::ptrdiff_t>(k * batch_size);
      metrics = kernel().update(network_, rule, learner, step, samples, first, batch,
                                weight ? weight + first : nullptr, workspace, errors + first);
    }
    return {metrics.loss, metrics.mean_q, metrics.max_q, metrics.gradient_norm};
  }

  struct Finally {
    std::atomic_flag& flag;
    ~Finally() { flag.clear(); }
  };

  Network network_;
  Block block_;
  std::atomic_flag learning_ = ATOMIC_FLAG_INIT;
};

}  // namespace

NB_MODULE(_fused, m) {
  m.def("simd", [] { return std::string(kernel().name); });
  nb::class_<Perceptron>(m, "Perceptron")
      .def(nb::init<std::int64_t, const std::vector<std::int64_t>&, std::int64_t, bool, bool>(),
           "num_observations"_a, "hidden_sizes"_a, "num_actions"_a, "layer_norm"_a = false,
           "dueling"_a = false)
      .def_prop_ro("num_params", &Perceptron::num_params)
      .def("values", &Perceptron::values, "params"_a.noconvert(), "observations"_a.noconvert(),
           "q"_a.noconvert())
      .def("learn", &Perceptron::learn, "online"_a.noconvert(), "target"_a.noconvert().none(),
           "mu"_a.noconvert(), "nu"_a.noconvert(), "num_updates"_a, "rates"_a.noconvert(),
           "words"_a.noconvert(), "weights"_a.noconvert().none(), "td_error"_a.noconvert(),
           "huber"_a, "double_q"_a, "sarsa"_a, "reward_scale"_a, "max_grad_norm"_a, "polyak"_a)
      .def("fit", &Perceptron::fit, "online"_a.noconvert(), "mu"_a.noconvert(),
           "nu"_a.noconvert(), "num_updates"_a, "rates"_a.noconvert(), "o_tm1"_a.noconvert(),
           "a_tm1"_a.noconvert(), "targets"_a.noconvert(), "order"_a.noconvert(),
           "td_error"_a.noconvert(), "huber"_a, "max_grad_norm"_a);
}

}  // namespace touchdown::fused
