// Constraints of any layouts, solved side by side, end with the bits that they end with alone.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "engine/kernel.hpp"
#include "tests/check.hpp"
#include "tests/engine/flying.hpp"

namespace {

using namespace touchdown::engine;
namespace simd = touchdown::simd;

// Steps that are about to be solved, taken from flights that end on the ground: in flight and
// standing, with one and two points, with and without joints at a limit.
std::vector<StepState> collected() {
  std::vector<StepState> states;
  for (std::uint32_t number = 0; number < 40; ++number) {
    Lander lander = seeded_lander(number);
    begin_alone(lander);
    for (int step = 0; step < 250; ++step) {
      const int action = number % 3 == 0 ? 0 : step % 2 == 0 ? 2 : static_cast<int>(number % 4);
      Lander copy = lander;
      auto state = std::make_unique<StepState>();
      Coverage coverage{};
      const bool solves = begin_step(copy, discrete_throttle(action), *state, coverage);
      const bool rare = solves && state->constraints.num_contacts > 0;
      if (solves && (rare || step % 25 == 0)) states.push_back(*state);
      step_alone(lander, discrete_throttle(action));
    }
  }
  return states;
}

void solve_alone(StepConstraints& constraints) {
  start_joints(constraints);
  for (int iteration = 0; iteration < kVelocityIterations; ++iteration) {
    for (auto& joint : constraints.joints) solve_velocity_constraint(joint, constraints.velocities);
    for (int i = 0; i < constraints.num_contacts; ++i) {
      solve_velocity_constraint(constraints.contacts[static_cast<std::size_t>(i)],
                                constraints.velocities);
    }
  }
}

template <typename T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

bool same_results(const StepConstraints& a, const StepConstraints& b) {
  bool same = same_bits(a.velocities, b.velocities);
  for (std::size_t i = 0; i < kNumLegs; ++i) {
    same = same && same_bits(a.joints[i].impulse, b.joints[i].impulse) &&
           same_bits(a.joints[i].limit_impulse, b.joints[i].limit_impulse) &&
           same_bits(a.joints[i].motor_impulse, b.joints[i].motor_impulse);
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.num_contacts); ++i) {
    same = same && same_bits(a.contacts[i].points, b.contacts[i].points) &&
           a.contacts[i].cases_seen == b.contacts[i].cases_seen;
  }
  return same;
}

TEST("constraints of different layouts in one vector are solved as each is alone") {
  const std::vector<StepState> states = collected();
  std::vector<StepState> alone = states;
  for (StepState& state : alone) solve_alone(state.constraints);
  CHECK(states.size() > 500);
  CHECK(std::any_of(states.begin(), states.end(),
                    [](const StepState& state) { return state.constraints.num_contacts > 2; }));
  for (const simd::InstructionSet set : simd::kInstructionSets) {
    if (!simd::is_available(set)) continue;
    const SolverKernel& solver = kernel(set);
    // Unsorted, as many as fill the lanes, and fewer.
    for (const std::size_t at_once : {solver.lanes, std::size_t{3}}) {
      for (const bool in_two_parts : {false, true}) {
        std::vector<StepState> together = states;
        for (std::size_t first = 0; first < states.size(); first += at_once) {
          std::vector<VelocityConstraints*> items;
          for (std::size_t i = first; i < std::min(first + at_once, states.size()); ++i) {
            items.push_back(&together[i].constraints);
          }
          if (!in_two_parts) {
            solver.solve(items, model());
            continue;
          }
          const auto done = std::make_unique<bool[]>(items.size());
          solver.start(items, {done.get(), items.size()}, model());
          std::vector<VelocityConstraints*> rest;
          for (std::size_t i = 0; i < items.size(); ++i) {
            if (!done[i]) rest.push_back(items[i]);
          }
          if (!rest.empty()) solver.resume(rest, model());
        }
        std::size_t differences = 0;
        for (std::size_t i = 0; i < states.size(); ++i) {
          differences += !same_results(together[i].constraints, alone[i].constraints);
        }
        CHECK_EQUAL(differences, std::size_t{0});
      }
    }
  }
}

}  // namespace

int main() { return touchdown::check::run_all(); }
