// The polygons of the hull and the legs, with their masses.
//
// Box2D: b2PolygonShape::Set, b2PolygonShape::ComputeMass and b2Body::ResetMassData.
#pragma once

#include <array>

#include "engine/math.hpp"
#include "engine/settings.hpp"
#include "engine/shape.hpp"

namespace touchdown::engine {

namespace detail {

// b2PolygonShape::Set's centroid: a sum over triangles from the origin.
inline Vec2 centroid(const Shape& shape) {
  Vec2 sum{0.0f, 0.0f};
  float area = 0.0f;
  for (int i = 0; i < shape.count; ++i) {
    const Vec2 a = shape.vertices[i];
    const Vec2 b = shape.vertices[(i + 1) % shape.count];
    const float triangle = 0.5f * cross(a, b);
    area += triangle;
    sum += triangle * (1.0f / 3.0f) * (Vec2{0.0f, 0.0f} + a + b);
  }
  return (1.0f / area) * sum;
}

// b2PolygonShape::ComputeMass and b2Body::ResetMassData: a sum over triangles from the vertices'
// mean.
inline void set_mass(Shape& shape, float density) {
  constexpr float third = 1.0f / 3.0f;
  Vec2 mean{0.0f, 0.0f};
  for (int i = 0; i < shape.count; ++i) mean += shape.vertices[i];
  mean = (1.0f / static_cast<float>(shape.count)) * mean;

  Vec2 center{0.0f, 0.0f};
  float area = 0.0f;
  float inertia = 0.0f;
  for (int i = 0; i < shape.count; ++i) {
    const Vec2 a = shape.vertices[i] - mean;
    const Vec2 b = shape.vertices[(i + 1) % shape.count] - mean;
    const float twice = cross(a, b);
    const float triangle = 0.5f * twice;
    area += triangle;
    center += triangle * third * (a + b);
    const float xx = a.x * a.x + b.x * a.x + b.x * b.x;
    const float yy = a.y * a.y + b.y * a.y + b.y * b.y;
    inertia += (0.25f * third * twice) * (xx + yy);
  }
  const float mass = density * area;
  center = (1.0f / area) * center;
  const Vec2 shifted = center + mean;
  const float about_origin =
      density * inertia + mass * (dot(shifted, shifted) - dot(center, center));

  shape.inverse_mass = 1.0f / mass;
  shape.local_center = shape.inverse_mass * (Vec2{0.0f, 0.0f} + mass * shifted);
  const float about_center = about_origin - mass * dot(shape.local_center, shape.local_center);
  shape.inverse_inertia = 1.0f / about_center;
}

// Needs the centre of mass. The result is a bound, so rounding must not make it too small.
inline void set_radius(Shape& shape) {
  for (int i = 0; i < shape.count; ++i) {
    const float distance = length(shape.vertices[i] - shape.local_center);
    shape.radius = larger(shape.radius, 1.001f * distance);
  }
}

inline Shape make_hull() {
  Shape hull{};
  constexpr double outline[][2] = {{17, -10}, {17, 0}, {14, 17}, {-14, 17}, {-17, 0}, {-17, -10}};
  hull.count = 6;
  for (int i = 0; i < hull.count; ++i) {
    hull.vertices[i] = {static_cast<float>(outline[i][0] / kScale),
                        static_cast<float>(outline[i][1] / kScale)};
  }
  for (int i = 0; i < hull.count; ++i) {
    hull.normals[i] = cross(hull.vertices[(i + 1) % hull.count] - hull.vertices[i], 1.0f);
    normalize(hull.normals[i]);
  }
  hull.centroid = centroid(hull);
  hull.friction = 0.1f;
  set_mass(hull, 5.0f);
  set_radius(hull);
  return hull;
}

inline Shape make_leg() {
  Shape leg{};
  const float half_width = static_cast<float>(2 / kScale);
  const float half_height = static_cast<float>(8 / kScale);
  leg.count = 4;
  leg.vertices = {{{-half_width, -half_height},
                   {half_width, -half_height},
                   {half_width, half_height},
                   {-half_width, half_height}}};
  leg.normals = {{{0.0f, -1.0f}, {1.0f, 0.0f}, {0.0f, 1.0f}, {-1.0f, 0.0f}}};
  leg.centroid = {0.0f, 0.0f};
  leg.friction = 0.2f;
  set_mass(leg, 1.0f);
  set_radius(leg);
  return leg;
}

}  // namespace detail

inline const std::array<Shape, kNumBodies> kShapes = {detail::make_hull(), detail::make_leg(),
                                                      detail::make_leg()};

}  // namespace touchdown::engine
