// Axis-aligned bounding boxes.
//
// Box2D: b2AABB. Three bodies against eleven edges are compared pair by pair, so there is no
// b2DynamicTree.
#pragma once

#include "engine/math.hpp"

namespace touchdown::engine {

// Only pairs of bodies whose boxes overlap are examined for contact.
struct Aabb {
  Vec2 lower;
  Vec2 upper;
};

constexpr Aabb grown(const Aabb& box, float margin) {
  const Vec2 r{margin, margin};
  return {box.lower - r, box.upper + r};
}
constexpr bool overlap(const Aabb& a, const Aabb& b) {
  return !(b.lower.x > a.upper.x || b.lower.y > a.upper.y || a.lower.x > b.upper.x ||
           a.lower.y > b.upper.y);
}
constexpr bool contains(const Aabb& outer, const Aabb& inner) {
  return outer.lower.x <= inner.lower.x && outer.lower.y <= inner.lower.y &&
         inner.upper.x <= outer.upper.x && inner.upper.y <= outer.upper.y;
}
constexpr Aabb combined(const Aabb& a, const Aabb& b) {
  return {smaller(a.lower, b.lower), larger(a.upper, b.upper)};
}

}  // namespace touchdown::engine
