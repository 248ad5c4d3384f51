#include "train/pqn_loop.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "fused/kernel.hpp"
#include "train/averaging.hpp"

namespace touchdown::train {
namespace {

// The largest value; NaN if one is NaN, as in NumPy.
float largest_of(const float* values, int count) { return values[greedy_action(values, count)]; }

}  // namespace

std::optional<fused::Metrics> PqnLoop::advance(const PqnParts& parts, std::int64_t max_steps,
                                               Counts& counts) {
  const Acting acting = acting_of(parts);
  return interaction_.advance(
      acting, max_steps, counts,
      [&](std::size_t i, EpisodeEnd end) { store(parts, i, end, counts); },
      [&] { return learn(parts, counts); });
}

void PqnLoop::store(const PqnParts& parts, std::size_t i, EpisodeEnd end,
                    const Counts& counts) const {
  const Environments& environments = parts.environments;
  const RolloutSteps& rollout = parts.rollout;
  constexpr std::size_t size = engine::kObservationSize;
  const std::size_t at = static_cast<std::size_t>(counts.filled) * environments.landers.size() + i;
  std::copy_n(parts.episodes.observations + i * size, size, rollout.o_tm1 + at * size);
  std::copy_n(environments.results.observations + i * size, size, rollout.o_t + at * size);
  rollout.a_tm1[at] = static_cast<std::int32_t>(environments.actions[i]);
  rollout.r_t[at] = static_cast<float>(environments.results.rewards[i]);
  rollout.terminated[at] = end.terminated ? 1.0f : 0.0f;
  rollout.truncated[at] = end.truncated && !end.terminated ? 1.0f : 0.0f;
}

Learnt PqnLoop::learn(const PqnParts& parts, Counts& counts) {
  if (++counts.filled < settings_.rollout.rollout_steps) return {};
  counts.filled = 0;
  Learnt learnt{.updated = true, .updates_before = counts.updates};
  check_actions(parts);
  if (mirror_) mirror_half(parts, *mirror_);
  draw_order(parts);
  compute_targets(parts);
  const fused::Metrics metrics = fit(parts, counts);
  if (parts.average) {
    add_to_average(parts.average, parts.learner.online, network_.num_params, settings_.averaging);
  }
  if (periods_crossed(learnt.updates_before, counts.updates, settings_.metrics_period) > 0) {
    learnt.metrics = metrics;
  }
  return learnt;
}

std::size_t PqnLoop::num_stored(const PqnParts& parts) const {
  return static_cast<std::size_t>(settings_.rollout.rollout_steps) *
         parts.environments.landers.size();
}

void PqnLoop::check_actions(const PqnParts& parts) const {
  const std::span<const std::int32_t> actions{parts.rollout.a_tm1, num_stored(parts)};
  for (const std::int32_t action : actions) {
    check_action(action, network_.num_actions, "a step of the rollout");
  }
}

void PqnLoop::mirror_half(const PqnParts& parts, const Mirror& mirror) {
  constexpr std::size_t size = engine::kObservationSize;
  const std::size_t num_envs = parts.environments.landers.size();
  chosen_.resize(num_envs);
  for (char& chosen : chosen_) chosen = draw_uniform(parts.replay) < 0.5;
  const RolloutSteps& rollout = parts.rollout;
  for (std::size_t at = 0; at < num_stored(parts); ++at) {
    if (!chosen_[at % num_envs]) continue;
    std::int32_t& action = rollout.a_tm1[at];
    action = mirror.actions[static_cast<std::size_t>(action)];
    for (float* observation : {rollout.o_tm1 + at * size, rollout.o_t + at * size}) {
      std::array<float, size> seen;
      std::copy_n(observation, size, seen.begin());
      mirror.reflect(seen.data(), observation);
    }
  }
}

std::size_t PqnLoop::batch_size() const {
  return drawn_.size() / static_cast<std::size_t>(settings_.rollout.minibatches);
}

void PqnLoop::draw_order(const PqnParts& parts) {
  drawn_.resize(num_stored(parts));
  const auto whole =
      static_cast<std::ptrdiff_t>(batch_size()) * settings_.rollout.minibatches;  // of the batches
  order_.clear();
  for (std::int64_t epoch = 0; epoch < settings_.rollout.epochs; ++epoch) {
    draw_permutation(parts.replay, drawn_);
    order_.insert(order_.end(), drawn_.begin(), drawn_.begin() + whole);
  }
}

void PqnLoop::compute_targets(const PqnParts& parts) {
  const std::size_t num_envs = parts.environments.landers.size(), num_steps = drawn_.size();
  const auto num_actions = static_cast<std::size_t>(network_.num_actions);
  q_t_.resize(num_steps * num_actions);
  best_.resize(num_steps);
  targets_.resize(num_steps);
  const fused::NetworkKernel& kernel = fused::kernel();
  kernel.values(network_, parts.learner.online, parts.rollout.o_t,
                static_cast<std::ptrdiff_t>(num_steps),
                block_.of_size(kernel.values_workspace(network_)), q_t_.data());
  for (std::size_t at = 0; at < num_steps; ++at) {
    best_[at] = largest_of(q_t_.data() + at * num_actions, network_.num_actions);
  }
  const auto gamma = static_cast<float>(settings_.gamma);
  const auto lambda = static_cast<float>(settings_.rollout.trace_decay);
  for (std::size_t at = num_steps; at-- > 0;) {
    const float reward = parts.rollout.r_t[at] * settings_.rule.reward_scale;
    const float discount = gamma * (1.0f - parts.rollout.terminated[at]);
    const float decay = lambda * (1.0f - parts.rollout.truncated[at]);
    const float following = at + num_envs < num_steps ? targets_[at + num_envs] : best_[at];
    const float mixed = decay * following + (1.0f - decay) * best_[at];
    targets_[at] = reward + discount * mixed;
  }
}

fused::Metrics PqnLoop::fit(const PqnParts& parts, Counts& counts) {
  const RolloutSteps& rollout = parts.rollout;
  const auto count = static_cast<std::size_t>(settings_.rollout.epochs) *
                     static_cast<std::size_t>(settings_.rollout.minibatches);
  learning_rates_after(settings_, counts.adam_updates, count, rates_);
  td_error_.resize(order_.size());
  fused::Samples samples;
  samples.o_tm1 = rollout.o_tm1;
  samples.a_tm1 = rollout.a_tm1;
  samples.r_t = targets_.data();
  samples.observation_stride = engine::kObservationSize;
  samples.stride = 1;
  samples.order = order_.data();
  fused::Rule rule;
  rule.huber = settings_.rule.huber;
  rule.max_grad_norm = settings_.rule.max_grad_norm;
  const auto batch = static_cast<int>(batch_size());
  const fused::Updates updates{.num_before = counts.adam_updates,
                               .count = count,
                               .batch_size = batch,
                               .rates = rates_.data(),
                               .td_error = td_error_.data()};
  const fused::Metrics metrics =
      fused::run_updates(network_, rule, parts.learner, samples, updates,
                         block_.of_size(fused::updates_workspace(network_, batch)));
  counts.updates += static_cast<std::int64_t>(count);
  counts.adam_updates += static_cast<std::int64_t>(count);
  return metrics;
}

}  // namespace touchdown::train
