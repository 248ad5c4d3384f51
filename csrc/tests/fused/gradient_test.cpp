// Forward and backward pass together: the gradient of an update is the numerical derivative of a
// loss that plain loops compute.
#include <cmath>
#include <iostream>

#include "fused/kernel.hpp"
#include "tests/check.hpp"
#include "tests/fused/slow_twin.hpp"

namespace {

using namespace touchdown::fused;
namespace simd = touchdown::simd;

constexpr std::size_t kBatch = 21;  // not a multiple of any panel

struct Updated {
  Doubles gradient;
  std::vector<float> td_error;
  Metrics metrics;
};

// One update of a copy of the parameters. Adam's first moment starts at 0, so it ends at (1 −
// β₁)·g.
Updated update_of(const NetworkKernel& kernel, const Network& network, std::vector<float> online,
                  std::vector<float> target, const Rule& rule, const RandomBatch& batch,
                  const std::vector<float>& weights) {
  std::vector<float> mu(online.size()), nu(online.size()), td_error(kBatch);
  std::vector<float> workspace(kernel.update_workspace(network, kBatch));
  const Learner learner{online.data(), target.data(), mu.data(), nu.data()};
  const Metrics metrics =
      kernel.update(network, rule, learner, step_size(rule, 1e-3f, 1.0), batch.samples, 0, kBatch,
                    weights.data(), workspace.data(), td_error.data());
  Doubles gradient;
  for (const float m : mu) gradient.push_back(m / (1.0 - static_cast<double>(rule.b1)));
  return {gradient, td_error, metrics};
}

double slow_target(const Network& network, const Doubles& online, const Doubles& target,
                   const Rule& rule, const RandomBatch& batch, std::size_t i) {
  const Doubles next = observation_of(batch.o_t, network, i);
  const Doubles q_t = slow_values(network, target, next);
  const Doubles selector = rule.double_q ? slow_values(network, online, next) : q_t;
  const auto greedy = std::max_element(selector.begin(), selector.end()) - selector.begin();
  const auto action = rule.sarsa ? batch.a_t[i] : greedy;
  return batch.r_t[i] * rule.reward_scale +
         batch.discount_t[i] * q_t[static_cast<std::size_t>(action)];
}

double slow_loss(const Network& network, const Doubles& online, const Doubles& targets,
                 const Rule& rule, const RandomBatch& batch, const std::vector<float>& weights) {
  double sum = 0.0;
  for (std::size_t i = 0; i < kBatch; ++i) {
    const Doubles q = slow_values(network, online, observation_of(batch.o_tm1, network, i));
    const double delta = std::fabs(targets[i] - q[static_cast<std::size_t>(batch.a_tm1[i])]);
    const double loss = !rule.huber    ? delta * delta
                        : delta <= 1.0 ? 0.5 * delta * delta
                                       : delta - 0.5;
    sum += weights[i] * loss;
  }
  return sum / kBatch;
}

void compare(const NetworkKernel& kernel, const Network& network, const Rule& rule) {
  const std::vector<float> online = random_params(network, 1), target = random_params(network, 2);
  const RandomBatch batch(network, kBatch, 3);
  std::vector<float> weights;
  for (std::size_t i = 0; i < kBatch; ++i) weights.push_back(0.1f * static_cast<float>(i));
  Doubles params(online.begin(), online.end()), targets;
  for (std::size_t i = 0; i < kBatch; ++i) {
    targets.push_back(slow_target(network, params, {target.begin(), target.end()}, rule, batch, i));
  }
  const Updated updated = update_of(kernel, network, online, target, rule, batch, weights);
  CHECK_NEAR(updated.metrics.loss, slow_loss(network, params, targets, rule, batch, weights), 1e-3);
  double squares = 0.0;
  for (std::size_t p = 0; p < params.size(); ++p) {
    constexpr double h = 1e-6;
    const double before = params[p];
    params[p] = before + h;
    const double above = slow_loss(network, params, targets, rule, batch, weights);
    params[p] = before - h;
    const double below = slow_loss(network, params, targets, rule, batch, weights);
    params[p] = before;
    const double slope = (above - below) / (2.0 * h);
    squares += slope * slope;
    CHECK_NEAR(updated.gradient[p], slope, 1e-3 * (1.0 + std::fabs(slope)));
  }
  CHECK_NEAR(updated.metrics.gradient_norm, std::sqrt(squares), 1e-3 * (1.0 + std::sqrt(squares)));
  for (std::size_t i = 0; i < kBatch; ++i) {
    const Doubles q = slow_values(network, params, observation_of(batch.o_tm1, network, i));
    CHECK_NEAR(updated.td_error[i], targets[i] - q[static_cast<std::size_t>(batch.a_tm1[i])], 1e-3);
  }
}

TEST("the gradient is the numerical derivative of the loss, under each instruction set") {
  Rule huber{.huber = true}, squared{.double_q = true, .reward_scale = 0.5f}, sarsa{.sarsa = true};
  for (const simd::InstructionSet set : simd::kInstructionSets) {
    if (!simd::is_available(set)) continue;
    for (const auto& [name, network] : networks()) {
      std::cerr << simd::name(set) << ", " << name << '\n';
      for (const Rule& rule : {huber, squared, sarsa}) compare(kernel(set), network, rule);
    }
  }
}

}  // namespace

int main() { return touchdown::check::run_all(); }
