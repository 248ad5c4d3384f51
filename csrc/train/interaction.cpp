#include "train/interaction.hpp"

#include <algorithm>

#include "engine/lander.hpp"
#include "fused/kernel.hpp"

namespace touchdown::train {

void Interaction::act(const Acting& acting, const Learnt& learnt, Counts& counts) {
  const Environments& environments = acting.environments;
  const std::size_t num_envs = environments.landers.size();
  const int num_actions = network_.num_actions;
  std::int64_t* const actions = environments.actions;
  explores_.resize(num_envs);
  for (char& explores : explores_) explores = draw_uniform(acting.exploration) < counts.epsilon;
  if (std::find(explores_.begin(), explores_.end(), 0) != explores_.end()) {
    if (!counts.knows_values) compute_values(acting, learnt, counts);
    for (std::size_t i = 0; i < num_envs; ++i) {
      actions[i] = greedy_action(acting.q + i * static_cast<std::size_t>(num_actions), num_actions);
    }
  }
  for (std::size_t i = 0; i < num_envs; ++i) {
    if (explores_[i] != 0) {
      actions[i] = draw_integer(acting.exploration, static_cast<std::uint32_t>(num_actions));
    }
    environments.throttles[i] = engine::discrete_throttle(static_cast<int>(actions[i]));
  }
  counts.epsilon_used = counts.epsilon;
  engine::step(environments.landers, environments.throttles, environments.tasks,
               environments.results, environments.workspaces, environments.workers);
}

std::int32_t Interaction::action_after(const Acting& acting, const float* observation,
                                       const Counts& counts) {
  if (draw_uniform(acting.exploration) < counts.epsilon) {
    return static_cast<std::int32_t>(
        draw_integer(acting.exploration, static_cast<std::uint32_t>(network_.num_actions)));
  }
  const fused::NetworkKernel& kernel = fused::kernel();
  alone_.resize(static_cast<std::size_t>(network_.num_actions));
  kernel.values(network_, sampled(acting.params, kActing, counts.env_steps), observation, 1,
                block_.of_size(kernel.values_workspace(network_)), alone_.data());
  return static_cast<std::int32_t>(greedy_action(alone_.data(), network_.num_actions));
}

const float* Interaction::sampled(const float* params, std::uint32_t purpose, std::int64_t number) {
  if (!network_.noisy) return params;
  const fused::NoiseSource source{
      .seed = settings_.seed, .purpose = purpose, .number = static_cast<std::uint32_t>(number)};
  noise_.resize(static_cast<std::size_t>(network_.num_noise));
  weights_.resize(static_cast<std::size_t>(network_.num_weights));
  fused::draw_noise(network_, source.key(), noise_);
  fused::kernel().sample_weights(network_, params, noise_.data(), weights_.data());
  return weights_.data();
}

void Interaction::compute_values(const Acting& acting, const Learnt& learnt, Counts& counts) {
  const fused::NetworkKernel& kernel = fused::kernel();
  const float* const params = learnt.updated
                                  ? sampled(acting.params, kNextValues, learnt.updates_before)
                                  : sampled(acting.params, kActing, counts.env_steps);
  kernel.values(network_, params, acting.episodes.observations,
                static_cast<std::ptrdiff_t>(acting.environments.landers.size()),
                block_.of_size(kernel.values_workspace(network_)), acting.q);
  counts.knows_values = true;
}

}  // namespace touchdown::train
