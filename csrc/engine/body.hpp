// A rigid body: one of the hull and its two legs.
//
// Box2D: b2Body with the b2FixtureProxy of its only fixture.
#pragma once

#include "engine/aabb.hpp"
#include "engine/lanes.hpp"
#include "engine/math.hpp"
#include "engine/motion.hpp"
#include "engine/settings.hpp"
#include "engine/shape.hpp"
#include "engine/sweep.hpp"

namespace touchdown::engine {

template <typename F>
struct BasicBody {
  BasicSweep<F> sweep;
  BasicTransform<F> transform;  // its rotation is always that of the sweep's angle
  Vec<F> linear_velocity;       // of the centre of mass, metres per second
  F angular_velocity;           // radians per second
  Vec<F> force;                 // accumulated for the next step
  F torque;
  F sleep_time;           // seconds at rest
  BasicAabb<F> fat_aabb;  // has a margin, so that it need not follow every small movement
  Whole<F> awake;
};
using Body = BasicBody<float>;

inline void wake(Body& body) {
  if (body.awake != 0) return;
  body.awake = 1;
  body.sleep_time = 0.0f;
}

inline void put_to_sleep(Body& body) {
  body.awake = 0;
  body.sleep_time = 0.0f;
  body.linear_velocity = {0.0f, 0.0f};
  body.angular_velocity = 0.0f;
  body.force = {0.0f, 0.0f};
  body.torque = 0.0f;
}

inline void place_transform(Body& body, Vec2 local_center) {
  body.transform = transform_about(body.sweep.center, rotation(body.sweep.angle), local_center);
}

inline Body body_at(const Shape& shape, Vec2 origin, float angle) {
  Body body{};
  body.transform = {origin, rotation(angle)};
  body.sweep.center = body.sweep.start_center = to_world(body.transform, shape.local_center);
  body.sweep.angle = body.sweep.start_angle = angle;
  body.fat_aabb = grown(aabb_of(shape, body.transform), kAabbExtension);
  body.awake = 1;
  return body;
}

// Once the body has left its fat box, makes a new one around its motion from `start` and a
// prediction of the next step (b2Fixture::Synchronize, b2DynamicTree::MoveProxy).
template <typename F>
inline void synchronize_aabb(BasicBody<F>& body, const Shape& shape,
                             const BasicTransform<F>& start) {
  const BasicAabb<F> swept = combined(aabb_of(shape, start), aabb_of(shape, body.transform));
  const auto stays = contains(body.fat_aabb, swept);
  if (all(stays)) return;
  BasicAabb<F> fat = grown(swept, kAabbExtension);
  const Vec<F> ahead = broadcast<F>(2.0f) * (body.transform.origin - start.origin);
  // Selected, since adding a zero could change the sign of another.
  fat.lower = {ahead.x < 0.0f ? fat.lower.x + ahead.x : fat.lower.x,
               ahead.y < 0.0f ? fat.lower.y + ahead.y : fat.lower.y};
  fat.upper = {ahead.x < 0.0f ? fat.upper.x : fat.upper.x + ahead.x,
               ahead.y < 0.0f ? fat.upper.y : fat.upper.y + ahead.y};
  body.fat_aabb = {select(stays, body.fat_aabb.lower, fat.lower),
                   select(stays, body.fat_aabb.upper, fat.upper)};
}

// Moves the body to the end of a step without impacts.
template <typename F>
inline void move_to(BasicBody<F>& body, const Shape& shape, BasicPose<F>& pose,
                    const BasicVelocity<F>& velocity) {
  const Vec<F> local_center = broadcast<F>(shape.local_center);
  // Not the body's own transform: that of a body just made differs by a rounding.
  const BasicTransform<F> start =
      transform_about(body.sweep.center, body.transform.rotation, local_center);
  body.sweep.start_center = body.sweep.center;
  body.sweep.start_angle = body.sweep.angle;
  body.sweep.center = pose.center;
  body.sweep.angle = pose.angle;
  body.linear_velocity = velocity.linear;
  body.angular_velocity = velocity.angular;
  body.transform = transform_of(pose, local_center);
  synchronize_aabb(body, shape, start);
}

// Counts how long the body has been at rest.
template <typename F>
inline void update_sleep_time(BasicBody<F>& body) {
  const auto moves = body.angular_velocity * body.angular_velocity >
                         kAngularSleepTolerance * kAngularSleepTolerance ||
                     dot(body.linear_velocity, body.linear_velocity) >
                         kLinearSleepTolerance * kLinearSleepTolerance;
  body.sleep_time = moves ? F{} : body.sleep_time + kTimeStep;
}

}  // namespace touchdown::engine
