// Bodies that would pass through the moon during a step: where they hit it, and what becomes of
// them.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>

#include "bodies.hpp"
#include "contacts.hpp"
#include "coverage.hpp"
#include "impact.hpp"
#include "motion.hpp"
#include "solver.hpp"
#include "terrain.hpp"
#include "world.hpp"

namespace touchdown {

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

// An iteration that has changed nothing will be followed by none that does.
inline void iterate_until_still(std::array<ContactRow, kNumEdges>& rows, int count,
                                Velocities& velocities) {
  Velocity& body = velocities[rows[0].body];
  for (int iteration = 0; iteration < kVelocityIterations; ++iteration) {
    const Velocity before = body;
    bool same = true;
    for (int i = 0; i < count; ++i) {
      const auto points = rows[i].points;
      iterate_velocity(rows[i], velocities);
      same = same && std::memcmp(&points, &rows[i].points, sizeof(points)) == 0;
    }
    if (same && std::memcmp(&before, &body, sizeof(before)) == 0) return;
  }
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
  Pose& pose = poses[index];
  pose = pose_at(body.sweep.center, body.sweep.angle, body.transform.rotation);
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
  body.sweep.start_center = pose.center;
  body.sweep.start_angle = pose.angle;
  const Transform start = transform_of(pose, shape.local_center);

  std::array<ContactRow, kNumEdges> rows;
  for (int i = 0; i < count; ++i) {
    rows[i] = prepare(contacts[touching[i]], world.terrain, poses, false);
  }
  iterate_until_still(rows, count, velocities);
  // These impulses may be huge, so they are not kept for the next step.

  integrate(pose, velocities[index], (1.0f - time) * kTimeStep);
  body.sweep.center = pose.center;
  body.sweep.angle = pose.angle;
  body.velocity = velocities[index].linear;
  body.spin = velocities[index].angular;
  body.transform = transform_of(pose, shape.local_center);
  move_box(body, shape, start);
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
  ++coverage.steps_with_impacts[std::min(solved, kMaxImpactsCounted - 1)];
}

}  // namespace touchdown
