// Continuous collision: bodies that would pass through the moon during a step are moved back to
// their time of impact (TOI) and continue from there.
//
// Box2D: b2World::SolveTOI and b2Island::SolveTOI.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include "engine/body.hpp"
#include "engine/contact.hpp"
#include "engine/contact_manager.hpp"
#include "engine/contact_solver.hpp"
#include "engine/contact_velocity_solver.hpp"
#include "engine/coverage.hpp"
#include "engine/math.hpp"
#include "engine/motion.hpp"
#include "engine/settings.hpp"
#include "engine/shapes.hpp"
#include "engine/sweep.hpp"
#include "engine/time_of_impact.hpp"
#include "engine/world.hpp"

namespace touchdown::engine {

namespace detail {

struct TimeOfImpactEvent {
  int contact;
  float time;
};

// The earliest event in the rest of the step; computes the times of impact that are not known yet.
// The index is -1 if there is none.
inline TimeOfImpactEvent find_first_event(World& world) {
  TimeOfImpactEvent first{-1, 1.0f};
  for (int i = world.contacts.count - 1; i >= 0; --i) {
    Contact& contact = world.contacts.items[i];
    if (contact.enabled == 0 || contact.toi_count > kMaxSubSteps) continue;
    if (contact.toi_known == 0) {
      Body& body = world.bodies[contact.body];
      if (body.awake == 0) continue;
      // Both sweeps have to start at the same time: the one that is behind is advanced.
      if (world.moon_start_time < body.sweep.start_time) {
        world.moon_start_time = body.sweep.start_time;
      } else if (body.sweep.start_time < world.moon_start_time) {
        advance_start(body.sweep, world.moon_start_time);
      }
      const float start = body.sweep.start_time;
      const Edge& edge = world.terrain.edges[contact.edge];
      const Shape& shape = kShapes[contact.body];
      const auto beta = is_out_of_reach(edge, shape, body.sweep, body.transform)
                            ? std::nullopt
                            : time_of_impact(edge, shape, body.sweep);
      contact.toi = beta ? smaller(start + (1.0f - start) * *beta, 1.0f) : 1.0f;
      contact.toi_known = 1;
    }
    if (contact.toi < first.time) first = {i, contact.toi};
  }
  return first;
}

// An iteration that changes nothing is followed only by iterations that change nothing.
inline void solve_velocities_until_still(std::array<ContactConstraint, kNumEdges>& constraints,
                                         int count, Velocities& velocities) {
  Velocity& body = velocities[constraints[0].body];
  for (int iteration = 0; iteration < kVelocityIterations; ++iteration) {
    const Velocity before = body;
    bool same = true;
    for (int i = 0; i < count; ++i) {
      const auto points = constraints[i].points;
      solve_velocity_constraint(constraints[i], velocities);
      same = same && std::memcmp(&points, &constraints[i].points, sizeof(points)) == 0;
    }
    if (same && std::memcmp(&before, &body, sizeof(before)) == 0) return;
  }
}

// Moves the body from its time of impact to the end of the step, solving only its own contacts: the
// joints wait for the next step.
inline void solve_event(World& world, int contact_index, float time) {
  auto& contacts = world.contacts.items;
  const int index = contacts[contact_index].body;
  Body& body = world.bodies[index];
  const Shape& shape = kShapes[index];

  std::array<int, kNumEdges> touching;
  int count = 0;
  touching[count++] = contact_index;
  for (int i = world.contacts.count - 1; i >= 0; --i) {
    if (i == contact_index || contacts[i].body != index) continue;
    update_contact(contacts[i], world.terrain, body, world.contact_flags);
    if (contacts[i].touching != 0) touching[count++] = i;
  }

  Poses poses;
  Velocities velocities;
  Pose& pose = poses[index];
  pose = pose_at(body.sweep.center, body.sweep.angle, body.transform.rotation);
  velocities[index] = {body.linear_velocity, body.angular_velocity};
  std::array<ContactPositionConstraint, kNumEdges> position_constraints;
  for (int i = 0; i < count; ++i) position_constraints[i] = prepare_position(contacts[touching[i]]);
  for (int iteration = 0; iteration < kTimeOfImpactPositionIterations; ++iteration) {
    float min_separation = 0.0f;
    for (int i = 0; i < count; ++i) {
      min_separation = smaller(
          min_separation,
          solve_position_constraint(position_constraints[i], poses, kTimeOfImpactBaumgarte));
    }
    if (min_separation >= -1.5f * kLinearSlop) break;
  }
  body.sweep.start_center = pose.center;
  body.sweep.start_angle = pose.angle;
  const Transform start = transform_of(pose, shape.local_center);

  std::array<ContactConstraint, kNumEdges> constraints;
  for (int i = 0; i < count; ++i) {
    constraints[i] = prepare(contacts[touching[i]], world.terrain, poses, false);
  }
  solve_velocities_until_still(constraints, count, velocities);
  // These impulses may be huge, so they are not stored for warm starting.

  integrate(pose, velocities[index], (1.0f - time) * kTimeStep);
  body.sweep.center = pose.center;
  body.sweep.angle = pose.angle;
  body.linear_velocity = velocities[index].linear;
  body.angular_velocity = velocities[index].angular;
  body.transform = transform_of(pose, shape.local_center);
  synchronize_aabb(body, shape, start);
  for (int i = 0; i < world.contacts.count; ++i) {
    if (contacts[i].body == index) contacts[i].toi_known = 0;
  }
  find_new_contacts(world.contacts, world.terrain, world.bodies);
}

}  // namespace detail

// Handles the step's time-of-impact events one by one, the earliest first.
inline void solve_continuous(World& world, Coverage& coverage) {
  for (Body& body : world.bodies) body.sweep.start_time = 0.0f;
  world.moon_start_time = 0.0f;
  for (int i = 0; i < world.contacts.count; ++i) {
    world.contacts.items[i].toi_known = 0;
    world.contacts.items[i].toi_count = 0;
  }

  int solved = 0;
  for (;;) {
    const detail::TimeOfImpactEvent event = detail::find_first_event(world);
    if (event.contact < 0 || 1.0f - 10.0f * kEpsilon < event.time) break;
    Contact& contact = world.contacts.items[event.contact];
    Body& body = world.bodies[contact.body];
    const Shape& shape = kShapes[contact.body];
    const Sweep sweep_before = body.sweep;
    const float moon_before = world.moon_start_time;

    world.moon_start_time = event.time;
    advance_start(body.sweep, event.time);
    body.sweep.center = body.sweep.start_center;
    body.sweep.angle = body.sweep.start_angle;
    place_transform(body, shape.local_center);
    update_contact(contact, world.terrain, body, world.contact_flags);
    contact.toi_known = 0;
    ++contact.toi_count;
    if (contact.touching == 0) {
      contact.enabled = 0;
      body.sweep = sweep_before;
      world.moon_start_time = moon_before;
      place_transform(body, shape.local_center);
      ++coverage.impacts_undone;
      continue;
    }
    wake(body);
    detail::solve_event(world, event.contact, event.time);
    ++solved;
  }
  ++coverage.steps_with_impacts[std::min(solved, kMaxImpactsCounted - 1)];
}

}  // namespace touchdown::engine
