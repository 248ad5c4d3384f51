// The step of everything that is joined and touching, as if nothing could be passed through.
//
// Five stages, each over plain rows: prepare them, iterate the velocities, integrate, iterate the
// positions, write back. Only the second and the fourth are hot, and they look at nothing but rows.
#pragma once

#include <algorithm>
#include <array>
#include <cfloat>

#include "bodies.hpp"
#include "contacts.hpp"
#include "coverage.hpp"
#include "joint.hpp"
#include "motion.hpp"
#include "solver.hpp"
#include "world.hpp"

namespace touchdown {

// The joints hold the three bodies in one island; only the order in which the search comes by
// contacts and joints depends on where it starts.
struct Island {
  std::array<int, kMaxContacts> contacts;  // indices
  int num_contacts;
  std::array<int, kNumLegs> joints;
};

inline Island find_island(const Contacts& contacts, const std::array<Body, kNumBodies>& bodies) {
  // The newest body that is awake comes first, and a body's newest joint is followed first.
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

// All that the iterations of one step read and change.
struct Rows : BasicVelocityRows<float> {
  Poses poses;
  std::array<ContactPositionRow, kMaxContacts> contact_positions;
};

// Applies forces and last step's impulses.
inline void prepare(Rows& rows, World& world, const Island& island) {
  for (int i = 0; i < kNumBodies; ++i) {
    const Body& body = world.bodies[i];
    const Shape& shape = kShapes[i];
    const Vec2 push = Vec2{0.0f, world.gravity} + shape.inverse_mass * body.force;
    rows.poses[i] = pose_at(body.sweep.center, body.sweep.angle, body.transform.rotation);
    rows.velocities[i] = {body.velocity + kTimeStep * push,
                          body.spin + kTimeStep * shape.inverse_inertia * body.torque};
  }
  rows.num_contacts = island.num_contacts;
  for (int i = 0; i < island.num_contacts; ++i) {
    const Contact& contact = world.contacts.items[island.contacts[i]];
    rows.contacts[i] = prepare(contact, world.terrain, rows.poses, true);
    rows.contact_positions[i] = prepare_position(contact);
    warm_start(rows.contacts[i], rows.velocities);
  }
  for (int i = 0; i < kNumLegs; ++i) {
    const int joint = island.joints[i];
    rows.joints[i] = prepare(world.joints[joint], kJointShapes[joint], rows.poses, rows.velocities);
  }
}

inline void integrate(Rows& rows) {
  for (int i = 0; i < kNumBodies; ++i) integrate(rows.poses[i], rows.velocities[i], kTimeStep);
}

// Returns after how many iterations all errors were small: one more than there are if never.
inline int iterate_positions(Rows& rows) {
  constexpr float share = 0.2f;
  for (int iteration = 1; iteration <= kPositionIterations; ++iteration) {
    float least = 0.0f;
    for (int i = 0; i < rows.num_contacts; ++i) {
      least = smaller(least, iterate_position(rows.contact_positions[i], rows.poses, share));
    }
    bool solved = least >= -3.0f * kLinearSlop;
    for (const JointRow& row : rows.joints) {
      const bool fits = iterate_position(row, kJointShapes[row.leg - kLeg0], rows.poses);
      solved = solved && fits;
    }
    if (solved) return iteration;
  }
  return kPositionIterations + 1;
}

inline void write_back(Rows& rows, World& world, const Island& island) {
  for (int i = 0; i < rows.num_contacts; ++i) {
    write_back(rows.contacts[i], world.contacts.items[island.contacts[i]].manifold);
  }
  for (const JointRow& row : rows.joints) write_back(row, world.joints[row.leg - kLeg0]);
  for (int i = 0; i < kNumBodies; ++i) {
    Body& body = world.bodies[i];
    const Shape& shape = kShapes[i];
    // Not the transform that it has: a body that was just made has another one, by a rounding.
    const Transform start =
        transform_about(body.sweep.center, body.transform.rotation, shape.local_center);
    body.sweep.start_center = body.sweep.center;
    body.sweep.start_angle = body.sweep.angle;
    body.sweep.center = rows.poses[i].center;
    body.sweep.angle = rows.poses[i].angle;
    body.velocity = rows.velocities[i].linear;
    body.spin = rows.velocities[i].angular;
    body.transform = transform_of(rows.poses[i], shape.local_center);
    move_box(body, shape, start);
  }
}

// All bodies fall asleep together, once the last of them has been at rest for long enough.
inline bool rest(std::array<Body, kNumBodies>& bodies, bool solved) {
  constexpr float time_to_sleep = 0.5f;      // seconds
  constexpr float linear_tolerance = 0.01f;  // metres a second
  constexpr float angular_tolerance = 2.0f / 180.0f * kPi;
  float least = FLT_MAX;
  for (Body& body : bodies) {
    if (body.spin * body.spin > angular_tolerance * angular_tolerance ||
        dot(body.velocity, body.velocity) > linear_tolerance * linear_tolerance) {
      body.sleep_time = 0.0f;
    } else {
      body.sleep_time += kTimeStep;
    }
    least = smaller(least, body.sleep_time);
  }
  if (!(least >= time_to_sleep && solved)) return false;
  for (Body& body : bodies) put_to_sleep(body);
  return true;
}

inline void count(const Rows& rows, Coverage& coverage) {
  ++coverage.steps_with_contacts[std::min(rows.num_contacts, kMaxContactsCounted - 1)];
  for (int i = 0; i < rows.num_contacts; ++i) {
    const ContactRow& row = rows.contacts[i];
    const int num_points = rows.contact_positions[i].num_points;
    ++(num_points == 1 ? coverage.one_point_manifolds : coverage.two_point_manifolds);
    if (row.num_points < num_points) ++coverage.redundant_points;
    for (int j = 0; j < kNumBlockCases; ++j) coverage.block_cases[j] += row.cases_seen >> j & 1;
  }
}

// A step under way: what the velocity iterations stand between.
struct Solving {
  Island island;
  std::array<Limit, kNumLegs> limits;  // before the step
  Rows rows;
};

inline void begin_solve(World& world, Solving& solving, Coverage& coverage) {
  solving.island = find_island(world.contacts, world.bodies);
  for (Body& body : world.bodies) {
    if (body.awake == 0) ++coverage.woke_up;
    wake(body);
  }
  solving.limits = {world.joints[0].limit, world.joints[1].limit};
  prepare(solving.rows, world, solving.island);
}

inline void finish_solve(World& world, Solving& solving, Coverage& coverage) {
  Rows& rows = solving.rows;
  integrate(rows);
  const int num_iterations = iterate_positions(rows);
  write_back(rows, world, solving.island);

  for (int i = 0; i < kNumLegs; ++i) {
    coverage.limit_switches += world.joints[i].limit != solving.limits[i];
  }
  coverage.all_position_iterations += num_iterations >= kPositionIterations;
  count(rows, coverage);
  coverage.fell_asleep += rest(world.bodies, num_iterations <= kPositionIterations);
  find_new(world.contacts, world.terrain, world.bodies);
}

}  // namespace touchdown
