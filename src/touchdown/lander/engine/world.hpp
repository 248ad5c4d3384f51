// The moon and the three bodies above it, and what a step leaves for the next one.
#pragma once

#include <array>

#include "bodies.hpp"
#include "contacts.hpp"
#include "joint.hpp"
#include "terrain.hpp"

namespace touchdown {

// What every step reads comes first and together, so that a flight high above the moon touches a few
// cache lines only.
struct World {
  float gravity;
  float moon_start_time;  // of the moon's sweep: it never moves, yet impacts put it forward
  Touches touches;
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
  body.velocity += shape.inverse_mass * impulse;
  body.spin += shape.inverse_inertia * cross(point - body.sweep.center, impulse);
}

}  // namespace touchdown
