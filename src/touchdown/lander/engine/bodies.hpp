// The three bodies that fly: the hull and its two legs, as shapes and as masses.
#pragma once

#include <array>
#include <cstdint>

#include "layout.hpp"
#include "math.hpp"

namespace touchdown {

inline constexpr double kScale = 30.0;  // pixels to a metre: stock's lengths are in pixels

inline constexpr float kLinearSlop = 0.005f;
inline constexpr float kSkin = 2.0f * kLinearSlop;  // the radius that rounds every shape

// A convex polygon, counter-clockwise, with what follows from it.
struct Shape {
  static constexpr int kMaxVertices = 6;
  std::array<Vec2, kMaxVertices> vertices;
  std::array<Vec2, kMaxVertices> normals;  // of the side that starts at the vertex
  int count;
  Vec2 centroid;      // decides which side of an edge the shape is on
  Vec2 local_center;  // of mass; equals the centroid up to rounding only
  float friction;
  float inverse_mass;
  float inverse_inertia;  // about the centre of mass
};

namespace detail {

// The centroid, by triangles about the origin.
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

// Mass, centre and inertia, by triangles about the mean of the vertices.
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
  return leg;
}

}  // namespace detail

inline const std::array<Shape, kNumBodies> kShapes = {detail::make_hull(), detail::make_leg(),
                                                      detail::make_leg()};

inline Box bounding_box(const Shape& shape, const Transform& transform) {
  Vec2 low = to_world(transform, shape.vertices[0]);
  Vec2 high = low;
  for (int i = 1; i < shape.count; ++i) {
    const Vec2 vertex = to_world(transform, shape.vertices[i]);
    low = smaller(low, vertex);
    high = larger(high, vertex);
  }
  return grown({low, high}, kSkin);
}

// The way of a centre of mass through one step. `start_*` is where it was at the fraction
// `start_time` of the step: 0, or the time of the last impact.
struct Sweep {
  Vec2 start_center;
  Vec2 center;
  float start_angle;
  float angle;
  float start_time;
};

// Moves the start of the sweep forward to `time`.
inline void advance_start(Sweep& sweep, float time) {
  const float beta = (time - sweep.start_time) / (1.0f - sweep.start_time);
  sweep.start_center = (1.0f - beta) * sweep.start_center + beta * sweep.center;
  sweep.start_angle = (1.0f - beta) * sweep.start_angle + beta * sweep.angle;
  sweep.start_time = time;
}

// Where the body is at the fraction `beta` of what is left of the sweep.
inline Transform transform_at(const Sweep& sweep, Vec2 local_center, float beta) {
  const Vec2 center = (1.0f - beta) * sweep.start_center + beta * sweep.center;
  const float angle = (1.0f - beta) * sweep.start_angle + beta * sweep.angle;
  return transform_about(center, rotation(angle), local_center);
}

struct Body {
  Sweep sweep;
  Transform transform;  // its rotation is always that of the sweep's angle
  Vec2 velocity;  // of the centre of mass
  float spin;     // radians a second
  Vec2 force;     // gathered for the next step
  float torque;
  float sleep_time;  // seconds at rest
  Box fat_box;       // wide enough to be left alone while the body moves a little
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
  body.velocity = {0.0f, 0.0f};
  body.spin = 0.0f;
  body.force = {0.0f, 0.0f};
  body.torque = 0.0f;
}

inline void place_transform(Body& body, Vec2 local_center) {
  body.transform = transform_about(body.sweep.center, rotation(body.sweep.angle), local_center);
}

inline constexpr float kBoxMargin = 0.1f;

inline Body body_at(const Shape& shape, Vec2 origin, float angle) {
  Body body{};
  body.transform = {origin, rotation(angle)};
  body.sweep.center = body.sweep.start_center = to_world(body.transform, shape.local_center);
  body.sweep.angle = body.sweep.start_angle = angle;
  body.fat_box = grown(bounding_box(shape, body.transform), kBoxMargin);
  body.awake = 1;
  return body;
}

}  // namespace touchdown
