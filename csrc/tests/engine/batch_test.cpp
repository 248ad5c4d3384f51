// Landers in a batch fly, to the last bit, as they do alone: under every instruction set that this
// machine has, and on any number of threads.
#include "engine/batch.hpp"

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "tests/check.hpp"
#include "tests/engine/flying.hpp"

namespace {

using namespace touchdown::engine;
namespace simd = touchdown::simd;

constexpr std::size_t kNumLanders =
    37;  // more than the widest kernel has lanes, and not a multiple
constexpr int kSteps = 220;

// A policy under which some fly, some crash and some stand on the ground; the same for both sides.
int action_of(std::size_t lander, int step) {
  switch (lander % 3) {
    case 0:
      return step % 4;
    case 1:
      return step % 2 == 0 ? 2 : 0;
    default:
      return static_cast<int>((lander + static_cast<std::size_t>(step / 7)) % 4);
  }
}

Config config_of_batch() {
  Config config;
  config.enable_wind = 1;
  return config;
}

struct Flight {
  std::vector<float> observations;
  std::vector<double> rewards;
};

Flight flown_alone() {
  Flight flight;
  std::vector<Lander> landers;
  std::vector<bool> ended(kNumLanders, true);
  for (std::uint32_t i = 0; i < kNumLanders; ++i) {
    landers.push_back(seeded_lander(i, config_of_batch()));
  }
  for (int step = 0; step < kSteps; ++step) {
    for (std::size_t i = 0; i < kNumLanders; ++i) {
      const bool begins = ended[i];
      const Transition transition =
          begins ? begin_alone(landers[i])
                 : step_alone(landers[i], discrete_throttle(action_of(i, step)));
      ended[i] = !begins && transition.terminated;
      flight.observations.insert(flight.observations.end(), transition.observation.begin(),
                                 transition.observation.end());
      flight.rewards.push_back(begins ? 0.0 : transition.reward);
    }
  }
  return flight;
}

Flight flown_in_a_batch(simd::InstructionSet set, std::size_t num_threads) {
  std::vector<Lander> landers;
  for (std::uint32_t i = 0; i < kNumLanders; ++i) {
    landers.push_back(seeded_lander(i, config_of_batch()));
  }
  std::vector<Throttle> throttles(kNumLanders);
  std::vector<Task> tasks(kNumLanders, Task::kBegin);
  std::vector<Workspace> workspaces;
  for (std::size_t i = 0; i < num_threads; ++i) workspaces.emplace_back(kernel(set));
  Workers workers(num_threads);
  std::vector<float> observations(kNumLanders * kObservationSize);
  std::vector<double> rewards(kNumLanders);
  const auto terminated = std::make_unique<bool[]>(kNumLanders);
  Flight flight;
  for (int number = 0; number < kSteps; ++number) {
    for (std::size_t i = 0; i < kNumLanders; ++i) {
      throttles[i] = discrete_throttle(action_of(i, number));
    }
    step(landers, throttles, tasks, {observations.data(), rewards.data(), terminated.get()},
         workspaces, workers);
    for (std::size_t i = 0; i < kNumLanders; ++i) {
      tasks[i] = terminated[i] ? Task::kBegin : Task::kStep;
    }
    flight.observations.insert(flight.observations.end(), observations.begin(), observations.end());
    flight.rewards.insert(flight.rewards.end(), rewards.begin(), rewards.end());
  }
  return flight;
}

template <typename T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

TEST("a batch flies as its landers do alone, under each instruction set and on several threads") {
  const Flight alone = flown_alone();
  for (const simd::InstructionSet set : simd::kInstructionSets) {
    if (!simd::is_available(set)) continue;
    for (const std::size_t num_threads : {1, 3}) {
      const Flight batch = flown_in_a_batch(set, num_threads);
      std::cerr << simd::name(set) << ", " << num_threads << " threads\n";
      CHECK(same_bits(batch.observations, alone.observations));
      CHECK(same_bits(batch.rewards, alone.rewards));
    }
  }
}

TEST("landers with nothing to do are left as they are") {
  std::vector<Lander> landers{seeded_lander(0), seeded_lander(1)};
  std::vector<Throttle> throttles(2);
  std::vector<Task> tasks{Task::kBegin, Task::kNothing};
  std::vector<Workspace> workspaces(1);
  Workers workers(1);
  std::vector<float> observations(2 * kObservationSize, 7.0f);
  std::vector<double> rewards(2, 7.0);
  bool terminated[2] = {true, true};
  step(landers, throttles, tasks, {observations.data(), rewards.data(), terminated}, workspaces,
       workers);
  CHECK_EQUAL(rewards[0], 0.0);
  CHECK_EQUAL(terminated[0], false);
  CHECK_EQUAL(landers[0].started, 1u);
  CHECK_EQUAL(rewards[1], 7.0);
  CHECK_EQUAL(terminated[1], true);
  CHECK_EQUAL(observations[kObservationSize], 7.0f);
  CHECK_EQUAL(landers[1].started, 0u);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
