// A rigid body: one of the hull and its two legs.
//
// Box2D: b2Body with the b2FixtureProxy of its only fixture.
#pragma once

#include <array>
#include <cstdint>

#include "engine/aabb.hpp"
#include "engine/math.hpp"
#include "engine/settings.hpp"
#include "engine/shapes.hpp"
#include "engine/sweep.hpp"

namespace touchdown::engine {

struct Body {
  Sweep sweep;
  Transform transform;     // its rotation is always that of the sweep's angle
  Vec2 linear_velocity;    // of the centre of mass, metres per second
  float angular_velocity;  // radians per second
  Vec2 force;              // accumulated for the next step
  float torque;
  float sleep_time;  // seconds at rest
  Aabb fat_aabb;     // has a margin, so that it need not follow every small movement
  std::uint32_t awake;
};

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

}  // namespace touchdown::engine
