#include "train/loop.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "fused/kernel.hpp"

namespace touchdown::train {

std::optional<fused::Metrics> Loop::advance(const Parts& parts, std::int64_t max_steps,
                                            Counts& counts) {
  const Acting acting{.environments = parts.environments,
                      .episodes = parts.episodes,
                      .params = parts.learner.online,
                      .q = parts.q,
                      .exploration = parts.exploration};
  return interaction_.advance(
      acting, max_steps, counts,
      [&](std::size_t i, bool truncated) { store(parts, i, truncated, counts); },
      [&] { return learn(parts, counts); });
}

void Loop::store(const Parts& parts, std::size_t i, bool truncated, Counts& counts) {
  const Environments& environments = parts.environments;
  const std::size_t size = parts.memory.num_observations;
  const auto n = static_cast<std::size_t>(settings_.n_step);
  float* const o_tm1 = parts.windows.o_tm1 + i * n * size;
  std::int32_t* const a_tm1 = parts.windows.a_tm1 + i * n;
  double* const r_t = parts.windows.r_t + i * n;
  auto length = static_cast<std::size_t>(parts.windows.lengths[i]);
  std::copy_n(parts.episodes.observations + i * size, size, o_tm1 + length * size);
  a_tm1[length] = static_cast<std::int32_t>(environments.actions[i]);
  r_t[length] = environments.results.rewards[i];
  ++length;

  const bool terminated = environments.results.terminated[i];
  const std::size_t complete = terminated || truncated ? length : (length == n ? 1 : 0);
  for (std::size_t first = 0; first < complete; ++first) {
    double total = 0.0;
    for (std::size_t k = length; k > first; --k) total = r_t[k - 1] + settings_.gamma * total;
    const double discount =
        terminated ? 0.0 : std::pow(settings_.gamma, static_cast<double>(length - first));
    const Step step{.o_tm1 = o_tm1 + first * size,
                    .a_tm1 = a_tm1[first],
                    .r_t = static_cast<float>(total),
                    .discount_t = static_cast<float>(discount),
                    .terminated = terminated,
                    .o_t = environments.results.observations + i * size};
    const std::int64_t copies = total > settings_.resave_threshold ? 1 + settings_.resaves : 1;
    for (std::int64_t copy = 0; copy < copies; ++copy) {
      prioritise_next(parts, counts);
      parts.memory.store(step, counts.added++);
    }
    if (!mirror_) continue;
    for (std::int64_t copy = 0; copy < copies; ++copy) {
      prioritise_next(parts, counts);
      parts.memory.store_image(step, *mirror_, counts.added++);
    }
  }
  std::copy(o_tm1 + complete * size, o_tm1 + length * size, o_tm1);
  std::copy(a_tm1 + complete, a_tm1 + length, a_tm1);
  std::copy(r_t + complete, r_t + length, r_t);
  parts.windows.lengths[i] = static_cast<std::int64_t>(length - complete);
}

void Loop::prioritise_next(const Parts& parts, const Counts& counts) const {
  if (!settings_.prioritized) return;
  parts.priorities.set(counts.added % parts.memory.capacity, counts.priorities.max_priority);
}

Learnt Loop::learn(const Parts& parts, Counts& counts) {
  const std::int64_t after = counts.env_steps;
  const std::int64_t before = after - static_cast<std::int64_t>(parts.environments.landers.size());
  const std::int64_t due = periods_crossed(before, after, settings_.update_period);
  Learnt learnt;
  if (due > 0 && parts.memory.size(counts.added) >= settings_.min_size) {
    learnt.updates_before = counts.updates;
    const fused::Metrics metrics = update(parts, due * settings_.gradient_steps, counts);
    learnt.updated = true;
    if (parts.average) average(parts);
    if (periods_crossed(learnt.updates_before, counts.updates, settings_.metrics_period) > 0) {
      learnt.metrics = metrics;
    }
  }
  const std::int64_t period = settings_.target_period;
  if (period > 0 && periods_crossed(before, after, period) > 0) {
    std::copy_n(parts.learner.online, network_.num_params, parts.learner.target);
  }
  return learnt;
}

void Loop::average(const Parts& parts) {
  const auto rate = static_cast<float>(settings_.averaging);
  for (std::ptrdiff_t i = 0; i < network_.num_params; ++i) {
    parts.average[i] += rate * (parts.learner.online[i] - parts.average[i]);
  }
}

fused::Metrics Loop::update(const Parts& parts, std::int64_t count, Counts& counts) {
  const fused::Samples packed =
      fused::packed_samples(parts.memory.records, network_.num_observations);
  draw(parts, packed, count, counts);
  rates_.resize(static_cast<std::size_t>(count));
  for (std::int64_t k = 0; k < count; ++k) {
    rates_[static_cast<std::size_t>(k)] = learning_rate_after(settings_, counts.adam_updates + k);
  }
  td_error_.resize(order_.size());
  fused::Samples samples = packed;
  samples.order = order_.data();
  const auto batch_size = static_cast<int>(settings_.batch_size);
  const fused::Updates updates{.num_before = counts.adam_updates,
                               .count = static_cast<std::size_t>(count),
                               .batch_size = batch_size,
                               .rates = rates_.data(),
                               .weights = settings_.prioritized ? weights_.data() : nullptr,
                               .noise = {.seed = settings_.seed,
                                         .purpose = kUpdates,
                                         .number = static_cast<std::uint32_t>(counts.updates)},
                               .td_error = td_error_.data()};
  float* const workspace = block_.of_size(fused::updates_workspace(network_, batch_size));
  const fused::Metrics metrics =
      fused::run_updates(network_, settings_.rule, parts.learner, samples, updates, workspace);
  counts.updates += count;
  counts.adam_updates += count;
  for (std::int64_t k = 0; settings_.prioritized && k < count; ++k) {
    const auto first = static_cast<std::size_t>(k * settings_.batch_size);
    const auto size = static_cast<std::size_t>(settings_.batch_size);
    update_priorities(settings_.priorities, parts.priorities,
                      std::span(order_).subspan(first, size),
                      std::span(td_error_).subspan(first, size), scratch_, counts.priorities);
  }
  return metrics;
}

void Loop::draw(const Parts& parts, const fused::Samples& packed, std::int64_t count,
                Counts& counts) {
  const std::int64_t num_held = parts.memory.size(counts.added);
  const auto batch_size = static_cast<std::size_t>(settings_.batch_size);
  order_.resize(static_cast<std::size_t>(count) * batch_size);
  if (settings_.prioritized) {
    weights_.resize(order_.size());
    scratch_.resize(batch_size);
    for (std::size_t first = 0; first < order_.size(); first += batch_size) {
      draw_by_priority(settings_.priorities, parts.priorities, num_held, parts.replay,
                       std::span(order_).subspan(first, batch_size),
                       std::span(weights_).subspan(first, batch_size), scratch_, counts.priorities);
    }
  } else {
    for (std::int64_t& index : order_) {
      index = draw_integer(parts.replay, static_cast<std::uint32_t>(num_held));
    }
  }
  for (const std::int64_t index : order_) {
    if (index >= num_held) throw std::invalid_argument("a priority without a stored transition");
    const std::int32_t action = packed.a_tm1[index * packed.stride];
    if (action < 0 || action >= network_.num_actions) {
      throw std::invalid_argument("a stored transition has action " + std::to_string(action) +
                                  ": must be from 0 to " +
                                  std::to_string(network_.num_actions - 1));
    }
  }
}

}  // namespace touchdown::train
