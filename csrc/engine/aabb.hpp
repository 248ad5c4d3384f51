// Axis-aligned bounding boxes.
//
// Box2D: b2AABB. Three bodies against eleven edges are compared pair by pair, so there is no
// b2DynamicTree.
#pragma once

#include "engine/math.hpp"

namespace touchdown::engine {

// Only pairs of bodies whose boxes overlap are examined for contact.
template <typename F>
struct BasicAabb {
  Vec<F> lower;
  Vec<F> upper;
};
using Aabb = BasicAabb<float>;

template <typename F>
constexpr BasicAabb<F> grown(const BasicAabb<F>& box, float margin) {
  const Vec<F> r{broadcast<F>(margin), broadcast<F>(margin)};
  return {box.lower - r, box.upper + r};
}
constexpr bool overlap(const Aabb& a, const Aabb& b) {
  return !(b.lower.x > a.upper.x || b.lower.y > a.upper.y || a.lower.x > b.upper.x ||
           a.lower.y > b.upper.y);
}
template <typename F>
constexpr auto contains(const BasicAabb<F>& outer, const BasicAabb<F>& inner) {
  return outer.lower.x <= inner.lower.x && outer.lower.y <= inner.lower.y &&
         inner.upper.x <= outer.upper.x && inner.upper.y <= outer.upper.y;
}
template <typename F>
constexpr BasicAabb<F> combined(const BasicAabb<F>& a, const BasicAabb<F>& b) {
  return {smaller(a.lower, b.lower), larger(a.upper, b.upper)};
}

}  // namespace touchdown::engine
