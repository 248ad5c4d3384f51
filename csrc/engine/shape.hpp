// A polygon with its mass, and its bounding box.
//
// Box2D: b2PolygonShape and b2MassData.
#pragma once

#include <array>

#include "engine/aabb.hpp"
#include "engine/math.hpp"
#include "engine/settings.hpp"

namespace touchdown::engine {

// A convex polygon with its vertices counter-clockwise, and the mass of a body made of it.
struct Shape {
  static constexpr int kMaxVertices = 6;
  std::array<Vec2, kMaxVertices> vertices;
  std::array<Vec2, kMaxVertices> normals;  // of the side that starts at the vertex
  int count;
  Vec2 centroid;      // decides which side of an edge the shape is on
  Vec2 local_center;  // centre of mass; equals the centroid only up to rounding
  float friction;
  float inverse_mass;
  float inverse_inertia;  // about the centre of mass
  float radius;           // no point is farther from the centre of mass
};

template <typename F>
inline BasicAabb<F> aabb_of(const Shape& shape, const BasicTransform<F>& transform) {
  Vec<F> low = to_world(transform, broadcast<F>(shape.vertices[0]));
  Vec<F> high = low;
  for (int i = 1; i < shape.count; ++i) {
    const Vec<F> vertex = to_world(transform, broadcast<F>(shape.vertices[i]));
    low = smaller(low, vertex);
    high = larger(high, vertex);
  }
  return grown(BasicAabb<F>{low, high}, kPolygonRadius);
}

}  // namespace touchdown::engine
