// The discrete step of all bodies, joints and touching contacts, without continuous collision.
//
// Box2D: b2World::Solve and b2Island::Solve. It has five stages: prepare the constraints, iterate
// the velocities, integrate, iterate the positions, write back. The second lies between
// `begin_solve` and `finish_solve`, so that many environments can be solved together.
#pragma once

#include <algorithm>
#include <array>
#include <cfloat>

#include "engine/body.hpp"
#include "engine/contact.hpp"
#include "engine/contact_manager.hpp"
#include "engine/contact_solver.hpp"
#include "engine/coverage.hpp"
#include "engine/motion.hpp"
#include "engine/revolute_joint.hpp"
#include "engine/shapes.hpp"
#include "engine/velocity_constraints.hpp"
#include "engine/world.hpp"

namespace touchdown::engine {

// The joints keep all three bodies in one island. Only the order in which the search meets contacts
// and joints depends on where it starts.
struct Island {
  std::array<int, kMaxContacts> contacts;  // indices
  int num_contacts;
  std::array<int, kNumLegs> joints;
};

inline Island find_island(const Contacts& contacts, const std::array<Body, kNumBodies>& bodies) {
  // The search starts at the newest body that is awake and follows a body's newest joint first.
  std::array<int, kNumBodies> order{kHull, kLeg0, kLeg1};
  Island island{};
  island.joints = {1, 0};
  if (bodies[kLeg1].awake != 0) {
    order = {kLeg1, kHull, kLeg0};
  } else if (bodies[kLeg0].awake != 0) {
    order = {kLeg0, kHull, kLeg1};
    island.joints = {0, 1};
  }
  for (const int body : order) {
    for (int i = contacts.count - 1; i >= 0; --i) {
      const Contact& contact = contacts.items[i];
      if (contact.body == body && contact.enabled != 0 && contact.touching != 0) {
        island.contacts[island.num_contacts++] = i;
      }
    }
  }
  return island;
}

// All that the velocity and the position iterations of one step read and change.
struct StepConstraints : VelocityConstraints {
  std::array<ContactPositionConstraint, kMaxContacts> contact_positions;
};

// Applies forces, sets up the constraints, and warm starts the contacts.
inline void prepare(StepConstraints& constraints, World& world, const Island& island) {
  for (int i = 0; i < kNumBodies; ++i) {
    const Body& body = world.bodies[i];
    const Shape& shape = kShapes[i];
    const Vec2 acceleration = Vec2{0.0f, world.gravity} + shape.inverse_mass * body.force;
    constraints.poses[i] = pose_at(body.sweep.center, body.sweep.angle, body.transform.rotation);
    constraints.velocities[i] = {
        body.linear_velocity + kTimeStep * acceleration,
        body.angular_velocity + kTimeStep * shape.inverse_inertia * body.torque};
  }
  constraints.num_contacts = island.num_contacts;
  for (int i = 0; i < island.num_contacts; ++i) {
    const Contact& contact = world.contacts.items[island.contacts[i]];
    constraints.contacts[i] = prepare(contact, world.terrain, constraints.poses, true);
    constraints.contact_positions[i] = prepare_position(contact);
    warm_start(constraints.contacts[i], constraints.velocities);
  }
  for (int i = 0; i < kNumLegs; ++i) {
    const int joint = island.joints[i];
    constraints.joints[i] =
        prepare(world.joints[joint], kJointDefinitions[joint], constraints.poses);
  }
}

// Completes the joints' constraints and warm starts them, after the contacts.
inline void start_joints(StepConstraints& constraints) {
  for (JointConstraint& joint : constraints.joints) {
    set_constants(joint, kJointDefinitions[joint.leg - kLeg0], constraints.poses);
    warm_start(joint, constraints.velocities);
  }
}

inline void integrate(StepConstraints& constraints) {
  for (int i = 0; i < kNumBodies; ++i) {
    integrate(constraints.poses[i], constraints.velocities[i], kTimeStep);
  }
}

// Returns the number of iterations after which all errors were small; one more than the maximum if
// they never were. The first `done` iterations were not enough.
inline int solve_position_constraints(StepConstraints& constraints, int done = 0) {
  for (int iteration = done + 1; iteration <= kPositionIterations; ++iteration) {
    float min_separation = 0.0f;
    for (int i = 0; i < constraints.num_contacts; ++i) {
      min_separation =
          smaller(min_separation, solve_position_constraint(constraints.contact_positions[i],
                                                            constraints.poses, kBaumgarte));
    }
    bool solved = min_separation >= -3.0f * kLinearSlop;
    for (const JointConstraint& joint : constraints.joints) {
      const bool joint_solved =
          solve_position_constraint(joint, kJointDefinitions[joint.leg - kLeg0], constraints.poses);
      solved = solved && joint_solved;
    }
    if (solved) return iteration;
  }
  return kPositionIterations + 1;
}

// Moves the bodies to their poses.
inline void place(StepConstraints& constraints, std::array<Body, kNumBodies>& bodies) {
  for (int i = 0; i < kNumBodies; ++i) {
    move_to(bodies[i], kShapes[i], constraints.poses[i], constraints.velocities[i]);
    update_sleep_time(bodies[i]);
  }
}

inline void store_impulses(const StepConstraints& constraints, World& world, const Island& island) {
  for (int i = 0; i < constraints.num_contacts; ++i) {
    store_impulses(constraints.contacts[i], world.contacts.items[island.contacts[i]].manifold);
  }
  for (const JointConstraint& joint : constraints.joints) {
    store_impulses(joint, world.joints[joint.leg - kLeg0]);
  }
}

// All bodies fall asleep together, once each has been at rest for long enough.
inline bool fall_asleep(std::array<Body, kNumBodies>& bodies, bool solved) {
  float min_sleep_time = FLT_MAX;
  for (const Body& body : bodies) min_sleep_time = smaller(min_sleep_time, body.sleep_time);
  if (!(min_sleep_time >= kTimeToSleep && solved)) return false;
  for (Body& body : bodies) put_to_sleep(body);
  return true;
}

inline void count_contacts(const StepConstraints& constraints, Coverage& coverage) {
  ++coverage.steps_with_contacts[std::min(constraints.num_contacts, kMaxContactsCounted - 1)];
  for (int i = 0; i < constraints.num_contacts; ++i) {
    const ContactConstraint& contact = constraints.contacts[i];
    const int num_points = constraints.contact_positions[i].num_points;
    ++(num_points == 1 ? coverage.one_point_manifolds : coverage.two_point_manifolds);
    if (contact.num_points < num_points) ++coverage.redundant_points;
    for (int j = 0; j < kNumBlockCases; ++j) coverage.block_cases[j] += contact.cases_seen >> j & 1;
  }
}

// The state of a step between `begin_solve` and `finish_solve`.
struct StepState {
  Island island;
  std::array<LimitState, kNumLegs> limits;  // before the step
  StepConstraints constraints;
};

inline void begin_solve(World& world, StepState& state, Coverage& coverage) {
  state.island = find_island(world.contacts, world.bodies);
  for (Body& body : world.bodies) {
    if (body.awake == 0) ++coverage.woke_up;
    wake(body);
  }
  state.limits = {world.joints[0].limit, world.joints[1].limit};
  prepare(state.constraints, world, state.island);
}

// What follows once the bodies are at their new places.
inline void conclude_solve(World& world, const StepState& state, int num_iterations,
                           Coverage& coverage) {
  const StepConstraints& constraints = state.constraints;
  store_impulses(constraints, world, state.island);
  for (int i = 0; i < kNumLegs; ++i) {
    coverage.limit_switches += world.joints[i].limit != state.limits[i];
  }
  coverage.all_position_iterations += num_iterations >= kPositionIterations;
  count_contacts(constraints, coverage);
  coverage.fell_asleep += fall_asleep(world.bodies, num_iterations <= kPositionIterations);
  find_new_contacts(world.contacts, world.terrain, world.bodies);
}

inline void finish_solve(World& world, StepState& state, Coverage& coverage) {
  integrate(state.constraints);
  const int num_iterations = solve_position_constraints(state.constraints);
  place(state.constraints, world.bodies);
  conclude_solve(world, state, num_iterations, coverage);
}

}  // namespace touchdown::engine
