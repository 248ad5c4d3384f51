// The moon, the three bodies above it, and all that one step leaves for the next.
//
// Box2D: b2World as Gymnasium's LunarLander.reset fills it, and b2Body::ApplyLinearImpulse.
#pragma once

#include <array>

#include "engine/body.hpp"
#include "engine/contact.hpp"
#include "engine/math.hpp"
#include "engine/revolute_joint.hpp"
#include "engine/settings.hpp"
#include "engine/shapes.hpp"
#include "engine/terrain.hpp"

namespace touchdown::engine {

// What every step reads comes first, so that a flight high above the moon touches few cache lines.
struct World {
  float gravity;
  // Of the moon's sweep (alpha0). The moon never moves, but time-of-impact events advance it.
  float moon_start_time;
  ContactFlags contact_flags;
  std::array<Body, kNumBodies> bodies;
  std::array<Joint, kNumLegs> joints;
  Terrain terrain;
  Contacts contacts;
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
  body.linear_velocity += shape.inverse_mass * impulse;
  body.angular_velocity += shape.inverse_inertia * cross(point - body.sweep.center, impulse);
}

}  // namespace touchdown::engine
