// Landers stepped one at a time and without lanes: the slow twin of a batch.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/contact_velocity_solver.hpp"
#include "engine/joint_velocity_solver.hpp"
#include "engine/lander.hpp"

namespace touchdown::engine {

inline Lander seeded_lander(std::uint32_t number, const Config& config = {}) {
  Lander lander = make_lander(config);
  seed(lander, std::vector<std::uint32_t>{number});
  return lander;
}

inline Transition finish_alone(Lander& lander, bool solves, StepState& state, Coverage& coverage) {
  if (solves) {
    StepConstraints& constraints = state.constraints;
    start_joints(constraints);
    for (int iteration = 0; iteration < kVelocityIterations; ++iteration) {
      for (auto& joint : constraints.joints) {
        solve_velocity_constraint(joint, constraints.velocities);
      }
      for (int i = 0; i < constraints.num_contacts; ++i) {
        solve_velocity_constraint(constraints.contacts[static_cast<std::size_t>(i)],
                                  constraints.velocities);
      }
    }
    finish_solve(lander.world, state, coverage);
  }
  return end_step(lander, coverage);
}

inline Transition begin_alone(Lander& lander) {
  StepState state;
  Coverage coverage{};
  const bool solves = begin_episode(lander, state, coverage);
  return finish_alone(lander, solves, state, coverage);
}

inline Transition step_alone(Lander& lander, const Throttle& throttle) {
  StepState state;
  Coverage coverage{};
  const bool solves = begin_step(lander, throttle, state, coverage);
  return finish_alone(lander, solves, state, coverage);
}

}  // namespace touchdown::engine
