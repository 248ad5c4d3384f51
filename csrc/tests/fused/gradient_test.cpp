// Forward and backward pass together: the gradient of an update is the numerical derivative of a
// loss that plain loops compute.
#include <algorithm>
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
                    weights.data(), nullptr, workspace.data(), td_error.data());
  Doubles gradient;
  for (const float m : mu) gradient.push_back(m / (1.0 - static_cast<double>(rule.b1)));
  return {gradient, td_error, metrics};
}

// What the outputs of the action taken should become: a value, quantiles, or probabilities.
Doubles slow_target(const Network& network, const Doubles& online, const Doubles& target,
                    const Rule& rule, const RandomBatch& batch, std::size_t i) {
  const Doubles next = observation_of(batch.o_t, network, i);
  const Doubles selector = slow_values(network, rule.double_q ? online : target, next);
  const auto greedy = std::max_element(selector.begin(), selector.end()) - selector.begin();
  const Doubles outputs =
      of_action(network, slow_outputs(network, target, next), rule.sarsa ? batch.a_t[i] : greedy);
  const double reward = batch.r_t[i] * rule.reward_scale, discount = batch.discount_t[i];
  const Prediction& prediction = network.prediction;
  Doubles wanted(outputs.size());
  if (prediction.kind == Prediction::kAtoms) {
    const Doubles probabilities = slow_softmax(outputs);
    const double least = prediction.v_min, greatest = prediction.v_max;
    for (std::size_t j = 0; j < outputs.size(); ++j) {
      const double moved =
          std::clamp(reward + discount * slow_atom(prediction, j), least, greatest);
      const double place = (moved - least) / (greatest - least) * (prediction.outputs - 1);
      const auto below = std::min(static_cast<std::size_t>(place), outputs.size() - 2);
      const double share = place - static_cast<double>(below);
      wanted[below] += (1.0 - share) * probabilities[j];
      wanted[below + 1] += share * probabilities[j];
    }
  } else {
    for (std::size_t j = 0; j < outputs.size(); ++j) wanted[j] = reward + discount * outputs[j];
  }
  return wanted;
}

double slow_huber(double error) {
  const double size = std::fabs(error);
  return size <= 1.0 ? 0.5 * size * size : size - 0.5;
}

// The loss of the outputs of the action taken.
double slow_loss(const Prediction& prediction, const Rule& rule, const Doubles& taken,
                 const Doubles& target) {
  double loss = 0.0;
  if (prediction.kind == Prediction::kMean) {
    const double error = target[0] - taken[0];
    return rule.huber ? slow_huber(error) : error * error;
  }
  if (prediction.kind == Prediction::kAtoms) {
    const Doubles probabilities = slow_softmax(taken);
    for (std::size_t i = 0; i < taken.size(); ++i) loss -= target[i] * std::log(probabilities[i]);
    return loss;
  }
  const auto count = static_cast<double>(taken.size());
  for (std::size_t i = 0; i < taken.size(); ++i) {
    const double tau = (static_cast<double>(i) + 0.5) / count;
    for (const double wanted : target) {
      const double error = wanted - taken[i];
      loss += std::fabs(tau - (error < 0.0 ? 1.0 : 0.0)) * slow_huber(error) / count;
    }
  }
  return loss;
}

double slow_loss(const Network& network, const Doubles& online, const std::vector<Doubles>& targets,
                 const Rule& rule, const RandomBatch& batch, const std::vector<float>& weights) {
  double sum = 0.0;
  for (std::size_t i = 0; i < kBatch; ++i) {
    const Doubles outputs = slow_outputs(network, online, observation_of(batch.o_tm1, network, i));
    sum += weights[i] * slow_loss(network.prediction, rule,
                                  of_action(network, outputs, batch.a_tm1[i]), targets[i]);
  }
  return sum / kBatch;
}

void compare(const NetworkKernel& kernel, const Network& network, const Rule& rule) {
  const std::vector<float> online = random_params(network, 1), target = random_params(network, 2);
  const RandomBatch batch(network, kBatch, 3);
  std::vector<float> weights;
  for (std::size_t i = 0; i < kBatch; ++i) weights.push_back(0.1f * static_cast<float>(i));
  Doubles params(online.begin(), online.end());
  std::vector<Doubles> targets;
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
    const double wanted = network.prediction.kind == Prediction::kAtoms
                              ? slow_mean(network.prediction, targets[i])
                              : mean_of(targets[i]);
    CHECK_NEAR(updated.td_error[i], wanted - q[static_cast<std::size_t>(batch.a_tm1[i])], 1e-3);
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
