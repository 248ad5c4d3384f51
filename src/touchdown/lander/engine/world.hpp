// One step of the physics: look at the contacts, solve, see what hits the moon on the way.
#pragma once

#include <array>
#include <cfloat>
#include <cstdint>

#include "bodies.hpp"
#include "contacts.hpp"
#include "coverage.hpp"
#include "impact.hpp"
#include "joint.hpp"
#include "motion.hpp"
#include "solver.hpp"
#include "terrain.hpp"

namespace touchdown {

struct World {
  Terrain terrain;
  std::array<Body, kNumBodies> bodies;
  std::array<Joint, kNumLegs> joints;
  Contacts contacts;
  Touches touches;
  float gravity;
  float moon_start_time;  // of the moon's sweep: it never moves, yet impacts put it forward
};

inline World make_world(const Terrain& terrain, float gravity) {
  World world{};
  world.terrain = terrain;
  world.gravity = gravity;
  const double x = kWorldWidth / 2;
  const auto y = static_cast<float>(kWorldHeight);
  world.bodies[kHull] = body_at(kShapes[kHull], {static_cast<float>(x), y}, 0.0f);
  for (int leg = kLeg0; leg <= kLeg1; ++leg) {
    const double side = leg == kLeg0 ? -1.0 : 1.0;
    const Vec2 origin{static_cast<float>(x - side * 20 / kScale), y};
    world.bodies[leg] = body_at(kShapes[leg], origin, static_cast<float>(side * 0.05));
  }
  return world;
}

inline void apply_impulse(Body& body, const Shape& shape, Vec2 impulse, Vec2 point) {
  wake(body);
  body.velocity += shape.inverse_mass * impulse;
  body.spin += shape.inverse_inertia * cross(point - body.sweep.center, impulse);
}

// Everything that moves and touches together. The joints hold the three bodies in one island; only
// the order in which the search comes by contacts and joints depends on where it starts.
struct Island {
  std::array<int, kMaxContacts> contacts;  // indices
  int num_contacts;
  std::array<int, kNumLegs> joints;
};

namespace detail {

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

inline void sleep_or_stay(std::array<Body, kNumBodies>& bodies, bool solved, Coverage& coverage) {
  constexpr float time_to_sleep = 0.5f;      // seconds
  constexpr float linear_tolerance = 0.01f;  // metres a second
  constexpr float angular_tolerance = 2.0f / 180.0f * kPi;
  float least = FLT_MAX;
  for (Body& body : bodies) {
    if (body.spin * body.spin > angular_tolerance * angular_tolerance ||
        dot(body.velocity, body.velocity) > linear_tolerance * linear_tolerance) {
      body.sleep_time = 0.0f;
      least = 0.0f;
    } else {
      body.sleep_time += kTimeStep;
      least = smaller(least, body.sleep_time);
    }
  }
  if (least >= time_to_sleep && solved) {
    for (Body& body : bodies) put_to_sleep(body);
    ++coverage.fell_asleep;
  }
}

inline void count_rows(const ContactRow& row, int num_points, Coverage& coverage) {
  ++(num_points == 1 ? coverage.one_point_manifolds : coverage.two_point_manifolds);
  if (row.num_points < num_points) ++coverage.redundant_points;
  for (int i = 0; i < kNumBlockCases; ++i) coverage.block_cases[i] += row.cases_seen >> i & 1u;
}

}  // namespace detail

// Moves all bodies through the step as if nothing could be passed through.
inline void solve(World& world, Coverage& coverage) {
  auto& bodies = world.bodies;
  auto& contacts = world.contacts.items;
  const Island island = detail::find_island(world.contacts, bodies);
  for (Body& body : bodies) {
    if (body.awake == 0) ++coverage.woke_up;
    wake(body);
  }

  Poses poses;
  Velocities velocities;
  for (int i = 0; i < kNumBodies; ++i) {
    Body& body = bodies[i];
    body.sweep.start_center = body.sweep.center;
    body.sweep.start_angle = body.sweep.angle;
    const Shape& shape = kShapes[i];
    const Vec2 push = Vec2{0.0f, world.gravity} + shape.inverse_mass * body.force;
    poses[i] = {body.sweep.center, body.sweep.angle};
    velocities[i] = {body.velocity + kTimeStep * push,
                     body.spin + kTimeStep * shape.inverse_inertia * body.torque};
  }

  std::array<ContactRow, kMaxContacts> rows;
  std::array<ContactPositionRow, kMaxContacts> position_rows;
  for (int i = 0; i < island.num_contacts; ++i) {
    const Contact& contact = contacts[island.contacts[i]];
    rows[i] = prepare(contact, world.terrain, poses, true);
    position_rows[i] = prepare_position(contact);
  }
  for (int i = 0; i < island.num_contacts; ++i) warm_start(rows[i], velocities);
  std::array<JointRow, kNumLegs> joint_rows;
  for (int i = 0; i < kNumLegs; ++i) {
    const int joint = island.joints[i];
    const Limit before = world.joints[joint].limit;
    joint_rows[i] = prepare(world.joints[joint], kJointShapes[joint], poses, velocities);
    coverage.limit_switches += world.joints[joint].limit != before;
  }

  for (int iteration = 0; iteration < kVelocityIterations; ++iteration) {
    for (JointRow& row : joint_rows) iterate_velocity(row, velocities);
    for (int i = 0; i < island.num_contacts; ++i) iterate_velocity(rows[i], velocities);
  }

  for (int i = 0; i < kNumBodies; ++i) integrate(poses[i], velocities[i], kTimeStep);

  bool solved = false;
  for (int iteration = 0; iteration < kPositionIterations && !solved; ++iteration) {
    constexpr float share = 0.2f;
    float least = 0.0f;
    for (int i = 0; i < island.num_contacts; ++i) {
      least = smaller(least, iterate_position(position_rows[i], poses, share));
    }
    solved = least >= -3.0f * kLinearSlop;
    for (int i = 0; i < kNumLegs; ++i) {
      const bool fits = iterate_position(joint_rows[i], kJointShapes[island.joints[i]], poses);
      solved = solved && fits;
    }
    if (iteration == kPositionIterations - 1) ++coverage.all_position_iterations;
  }

  for (int i = 0; i < island.num_contacts; ++i) {
    Manifold& manifold = contacts[island.contacts[i]].manifold;
    detail::count_rows(rows[i], static_cast<int>(manifold.count), coverage);
    write_back(rows[i], manifold);
  }
  for (int i = 0; i < kNumLegs; ++i) write_back(joint_rows[i], world.joints[island.joints[i]]);
  for (int i = 0; i < kNumBodies; ++i) {
    Body& body = bodies[i];
    body.sweep.center = poses[i].center;
    body.sweep.angle = poses[i].angle;
    body.velocity = velocities[i].linear;
    body.spin = velocities[i].angular;
    place_transform(body, kShapes[i].local_center);
  }
  detail::sleep_or_stay(bodies, solved, coverage);
  for (int i = 0; i < kNumBodies; ++i) move_box(bodies[i], kShapes[i]);
  find_new(world.contacts, world.terrain, bodies);
}

namespace detail {

inline constexpr int kMaxImpacts = 8;  // a contact that had more than these is left alone

// The earliest impact of the step that is left, as an index and a time; computes those not known.
struct Impact {
  int contact;
  float time;
};

inline Impact find_impact(World& world) {
  Impact first{-1, 1.0f};
  for (int i = world.contacts.count - 1; i >= 0; --i) {
    Contact& contact = world.contacts.items[i];
    if (contact.enabled == 0 || contact.num_impacts > kMaxImpacts) continue;
    if (contact.impact_known == 0) {
      Body& body = world.bodies[contact.body];
      if (body.awake == 0) continue;
      // Both sweeps have to start at the same time, so whichever is behind is put forward.
      if (world.moon_start_time < body.sweep.start_time) {
        world.moon_start_time = body.sweep.start_time;
      } else if (body.sweep.start_time < world.moon_start_time) {
        advance_start(body.sweep, world.moon_start_time);
      }
      const float start = body.sweep.start_time;
      const auto beta =
          time_of_impact(world.terrain.edges[contact.edge], kShapes[contact.body], body.sweep);
      contact.impact_time = beta ? smaller(start + (1.0f - start) * *beta, 1.0f) : 1.0f;
      contact.impact_known = 1;
    }
    if (contact.impact_time < first.time) first = {i, contact.impact_time};
  }
  return first;
}

// Goes on from the impact to the end of the step with this body and its contacts alone: the joints
// have to wait for the next step.
inline void solve_impact(World& world, int contact_index, float time) {
  auto& contacts = world.contacts.items;
  const int index = contacts[contact_index].body;
  Body& body = world.bodies[index];
  const Shape& shape = kShapes[index];

  std::array<int, kNumEdges> touching;
  int count = 0;
  touching[count++] = contact_index;
  for (int i = world.contacts.count - 1; i >= 0; --i) {
    if (i == contact_index || contacts[i].body != index) continue;
    update(contacts[i], world.terrain, body, world.touches);
    if (contacts[i].touching != 0) touching[count++] = i;
  }

  Poses poses;
  Velocities velocities;
  poses[index] = {body.sweep.center, body.sweep.angle};
  velocities[index] = {body.velocity, body.spin};
  std::array<ContactPositionRow, kNumEdges> position_rows;
  for (int i = 0; i < count; ++i) position_rows[i] = prepare_position(contacts[touching[i]]);
  for (int iteration = 0; iteration < 20; ++iteration) {
    constexpr float share = 0.75f;
    float least = 0.0f;
    for (int i = 0; i < count; ++i) {
      least = smaller(least, iterate_position(position_rows[i], poses, share));
    }
    if (least >= -1.5f * kLinearSlop) break;
  }
  body.sweep.start_center = poses[index].center;
  body.sweep.start_angle = poses[index].angle;

  std::array<ContactRow, kNumEdges> rows;
  for (int i = 0; i < count; ++i) {
    rows[i] = prepare(contacts[touching[i]], world.terrain, poses, false);
  }
  for (int iteration = 0; iteration < kVelocityIterations; ++iteration) {
    for (int i = 0; i < count; ++i) iterate_velocity(rows[i], velocities);
  }
  // These impulses may be huge, so they are not kept for the next step.

  integrate(poses[index], velocities[index], (1.0f - time) * kTimeStep);
  body.sweep.center = poses[index].center;
  body.sweep.angle = poses[index].angle;
  body.velocity = velocities[index].linear;
  body.spin = velocities[index].angular;
  place_transform(body, shape.local_center);
  move_box(body, shape);
  for (int i = 0; i < world.contacts.count; ++i) {
    if (contacts[i].body == index) contacts[i].impact_known = 0;
  }
  find_new(world.contacts, world.terrain, world.bodies);
}

}  // namespace detail

// Takes back the way of bodies that hit the moon during the step, from the first impact on.
inline void solve_impacts(World& world, Coverage& coverage) {
  for (Body& body : world.bodies) body.sweep.start_time = 0.0f;
  world.moon_start_time = 0.0f;
  for (int i = 0; i < world.contacts.count; ++i) {
    world.contacts.items[i].impact_known = 0;
    world.contacts.items[i].num_impacts = 0;
  }

  int solved = 0;
  for (;;) {
    const detail::Impact impact = detail::find_impact(world);
    if (impact.contact < 0 || 1.0f - 10.0f * kEpsilon < impact.time) break;
    Contact& contact = world.contacts.items[impact.contact];
    Body& body = world.bodies[contact.body];
    const Shape& shape = kShapes[contact.body];
    const Sweep sweep_before = body.sweep;
    const float moon_before = world.moon_start_time;

    world.moon_start_time = impact.time;
    advance_start(body.sweep, impact.time);
    body.sweep.center = body.sweep.start_center;
    body.sweep.angle = body.sweep.start_angle;
    place_transform(body, shape.local_center);
    update(contact, world.terrain, body, world.touches);
    contact.impact_known = 0;
    ++contact.num_impacts;
    if (contact.touching == 0) {
      contact.enabled = 0;
      body.sweep = sweep_before;
      world.moon_start_time = moon_before;
      place_transform(body, shape.local_center);
      ++coverage.impacts_undone;
      continue;
    }
    wake(body);
    detail::solve_impact(world, impact.contact, impact.time);
    ++solved;
  }
  const int slot = solved < kMaxImpactsCounted ? solved : kMaxImpactsCounted - 1;
  ++coverage.steps_with_impacts[slot];
}

inline void step(World& world, Coverage& coverage) {
  update_all(world.contacts, world.terrain, world.bodies, world.touches);
  bool any_awake = false;
  for (const Body& body : world.bodies) any_awake = any_awake || body.awake != 0;
  if (any_awake) solve(world, coverage);
  solve_impacts(world, coverage);
  for (Body& body : world.bodies) {
    body.force = {0.0f, 0.0f};
    body.torque = 0.0f;
  }
  ++coverage.steps;
  const auto pairs = static_cast<std::uint64_t>(world.contacts.count);
  if (pairs > coverage.most_pairs) coverage.most_pairs = pairs;
  std::uint64_t touching = 0;
  for (int i = 0; i < world.contacts.count; ++i) touching += world.contacts.items[i].touching;
  if (touching > coverage.most_contacts) coverage.most_contacts = touching;
}

}  // namespace touchdown
