// Times each part of the kernel's update, for benchmarks/update_parts.py.
//
//     parts BATCH LAYER_NORM WIDTH...
//
// prints a line for each part: its name and the microseconds it takes, the least of many.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "fused/network.cpp"
#include "fused/update_kernel.cpp"

namespace touchdown::fused {
namespace {

using namespace TOUCHDOWN_KERNEL;

constexpr int kObservations = 8, kActions = 4, kRepetitions = 400;

template <typename Part>
void time_part(const char* name, const Part& part) {
  using Clock = std::chrono::steady_clock;
  double least = 1e9;
  for (int i = 0; i < kRepetitions; ++i) {
    const auto began = Clock::now();
    part();
    least =
        std::min(least, std::chrono::duration<double, std::micro>(Clock::now() - began).count());
  }
  std::printf("%s,%.2f\n", name, least);
}

std::vector<float> random_floats(std::size_t count, std::mt19937& rng) {
  std::normal_distribution<float> normal(0.0f, 0.2f);
  std::vector<float> values(count);
  for (float& value : values) value = normal(rng);
  return values;
}

void time_parts(int batch_size, bool layer_norm, const std::vector<std::int64_t>& hidden) {
  const Network network = make_network(kObservations, hidden, kActions, layer_norm, false,
                                       make_prediction(0, 0, 0.0, 0.0));
  std::mt19937 rng(1);
  const auto params = static_cast<std::size_t>(network.num_params);
  const auto samples_floats = static_cast<std::size_t>(batch_size * kObservations);
  std::vector<float> online = random_floats(params, rng), target = online;
  std::vector<float> mu(params), nu(params), td_error(static_cast<std::size_t>(batch_size));
  const std::vector<float> before = random_floats(samples_floats, rng);
  const std::vector<float> after = random_floats(samples_floats, rng);
  const std::vector<float> rewards(static_cast<std::size_t>(batch_size), 0.1f);
  const std::vector<float> discounts(static_cast<std::size_t>(batch_size), 0.99f);
  std::vector<std::int32_t> actions(static_cast<std::size_t>(batch_size));
  for (std::int32_t& action : actions) action = static_cast<std::int32_t>(rng() % kActions);

  Samples samples;
  samples.o_tm1 = before.data();
  samples.a_tm1 = actions.data();
  samples.r_t = rewards.data();
  samples.discount_t = discounts.data();
  samples.o_t = after.data();
  samples.observation_stride = kObservations;
  samples.stride = 1;
  Rule rule;
  rule.huber = true;
  rule.max_grad_norm = 10.0f;
  const Learner learner{online.data(), target.data(), mu.data(), nu.data()};
  StepSize step;
  step.rate = 1e-6f;
  step.correction1 = 0.1f;
  step.correction2 = 0.001f;

  std::vector<float> memory(lay_out(network, batch_size, nullptr, nullptr) + 16);
  const std::size_t past = reinterpret_cast<std::uintptr_t>(memory.data()) % 64 / sizeof(float);
  float* const block = memory.data() + (past ? 16 - past : 0);
  Workspace w;
  lay_out(network, batch_size, block, &w);
  const int panels = num_panels(batch_size);
  Totals totals;

  time_part("update", [&] {
    update(network, rule, learner, step, samples, 0, batch_size, nullptr, nullptr, block,
           td_error.data());
  });
  time_part("gather", [&] {
    for (int panel = 0; panel < panels; ++panel) {
      gather(samples.o_tm1, samples, panel * kPanel, kPanel, kObservations, w.inputs,
             w.input_samples + panel * kPanel * padded(kObservations));
      gather(samples.o_t, samples, panel * kPanel, kPanel, kObservations, w.scratch[0], nullptr);
    }
  });
  time_part("forward, activations kept", [&] {
    for (int panel = 0; panel < panels; ++panel) {
      forward_storing_activations(network, online.data(), w, panel);
    }
  });
  time_part("forward, target network", [&] {
    for (int panel = 0; panel < panels; ++panel) {
      forward(network, target.data(), w.scratch[0], w.scratch[1], w.state_value, w.outputs_t);
      action_values(network, w.outputs_t, w.q_t);
    }
  });
  time_part("TD errors", [&] {
    for (int panel = 0; panel < panels; ++panel) {
      const int begin = panel * kPanel;
      td_errors(
          network, rule, samples, begin, std::min(kPanel, batch_size - begin), batch_size, nullptr,
          w, w.advantage_grad + static_cast<std::ptrdiff_t>(panel) * network.advantage.out * kPanel,
          td_error.data() + begin, &totals);
    }
  });
  time_part("backward, to the inputs", [&] {
    for (int panel = 0; panel < panels; ++panel) backward(network, online.data(), w, panel);
  });
  time_part("gradient of the weights", [&] { parameter_gradient(network, w, panels); });
  volatile float norm = 0.0f;
  time_part("norm for clipping", [&] { norm = global_norm(w.gradient, network.num_params); });
  time_part("Adam", [&] { adam_step(rule, learner, step, w.gradient, 1.0f, network.num_params); });
}

}  // namespace
}  // namespace touchdown::fused

int main(int count, char** words) {
  if (count < 4) return 2;
  std::vector<std::int64_t> hidden;
  for (int i = 3; i < count; ++i) hidden.push_back(std::atoll(words[i]));
  touchdown::fused::time_parts(std::atoi(words[1]), std::atoi(words[2]) != 0, hidden);
}
