#include "train/loop.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "fused/kernel.hpp"
#include "train/averaging.hpp"

namespace touchdown::train {

std::optional<fused::Metrics> Loop::advance(const Parts& parts, std::int64_t max_steps,
                                            Counts& counts) {
  const Acting acting = acting_of(parts);
  return interaction_.advance(
      acting, max_steps, counts,
      [&](std::size_t i, EpisodeEnd end) { store(parts, acting, i, end, counts); },
      [&] { return learn(parts, counts); });
}

void Loop::store(const Parts& parts, const Acting& acting, std::size_t i, EpisodeEnd end,
                 Counts& counts) {
  const Environments& environments = parts.environments;
  const std::size_t size = parts.memory.num_observations;
  const auto n = static_cast<std::size_t>(settings_.n_step);
  const bool sarsa = settings_.rule.sarsa;
  const float* const o_tm1 = parts.episodes.observations + i * size;
  const float* const o_t = environments.results.observations + i * size;
  const auto action = static_cast<std::int32_t>(environments.actions[i]);
  std::int64_t& length = parts.windows.lengths[i];
  // A transition of SARSA waits for the action after it.
  if (sarsa && length == settings_.n_step) {
    store_oldest(parts, i, 1, {.terminated = false, .a_t = action, .o_t = o_tm1}, counts);
  }
  const std::size_t place = i * n + static_cast<std::size_t>(length++);
  std::copy_n(o_tm1, size, parts.windows.o_tm1 + place * size);
  parts.windows.a_tm1[place] = action;
  parts.windows.r_t[place] = environments.results.rewards[i];

  Step last{.terminated = end.terminated, .a_t = 0, .o_t = o_t};
  if (end.terminated || end.truncated) {
    if (sarsa && !end.terminated) last.a_t = interaction_.action_after(acting, o_t, counts);
    store_oldest(parts, i, static_cast<std::size_t>(length), last, counts);
  } else if (!sarsa && length == settings_.n_step) {
    store_oldest(parts, i, 1, last, counts);
  }
}

void Loop::store_oldest(const Parts& parts, std::size_t i, std::size_t complete, const Step& last,
                        Counts& counts) {
  const std::size_t size = parts.memory.num_observations;
  const auto n = static_cast<std::size_t>(settings_.n_step);
  float* const o_tm1 = parts.windows.o_tm1 + i * n * size;
  std::int32_t* const a_tm1 = parts.windows.a_tm1 + i * n;
  double* const r_t = parts.windows.r_t + i * n;
  const auto length = static_cast<std::size_t>(parts.windows.lengths[i]);
  for (std::size_t first = 0; first < complete; ++first) {
    double total = 0.0;
    for (std::size_t k = length; k > first; --k) total = r_t[k - 1] + settings_.gamma * total;
    Step step = last;
    step.o_tm1 = o_tm1 + first * size;
    step.a_tm1 = a_tm1[first];
    step.r_t = static_cast<float>(total);
    step.discount_t =
        last.terminated
            ? 0.0f
            : static_cast<float>(std::pow(settings_.gamma, static_cast<double>(length - first)));
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
    if (parts.average) {
      add_to_average(parts.average, parts.learner.online, network_.num_params, settings_.averaging);
    }
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

fused::Metrics Loop::update(const Parts& parts, std::int64_t count, Counts& counts) {
  const fused::Samples packed =
      fused::packed_samples(parts.memory.records, network_.num_observations);
  draw(parts, packed, count, counts);
  learning_rates_after(settings_, counts.adam_updates, static_cast<std::size_t>(count), rates_);
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

void Loop::need_action(std::int32_t action) const {
  check_action(action, network_.num_actions, "a stored transition");
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
    need_action(packed.a_tm1[index * packed.stride]);
    if (settings_.rule.sarsa) need_action(packed.a_t[index * packed.stride]);
  }
}

}  // namespace touchdown::train
