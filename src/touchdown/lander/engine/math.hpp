// Plane geometry in single precision.
//
// Every expression here is part of the promise that a flight equals stock Gymnasium's bit for bit:
// the order of the operations and the treatment of equal arguments are fixed, and the sine and
// cosine are the C library's own.
#pragma once

#include <cfloat>
#include <cmath>

#include "lanes.hpp"

namespace touchdown {

inline constexpr float kEpsilon = FLT_EPSILON;
inline constexpr float kPi = 3.14159265359f;

// `F` is a float, or as many floats as there are lanes (lanes.hpp).
template <typename F>
struct Vec {
  F x;
  F y;
};
using Vec2 = Vec<float>;

template <typename F>
constexpr Vec<F> operator-(Vec<F> a) {
  return {-a.x, -a.y};
}
template <typename F>
constexpr Vec<F> operator+(Vec<F> a, Vec<F> b) {
  return {a.x + b.x, a.y + b.y};
}
template <typename F>
constexpr Vec<F> operator-(Vec<F> a, Vec<F> b) {
  return {a.x - b.x, a.y - b.y};
}
template <typename F>
constexpr Vec<F> operator*(F s, Vec<F> a) {
  return {s * a.x, s * a.y};
}
template <typename F>
constexpr Vec<F>& operator+=(Vec<F>& a, Vec<F> b) {
  return a = a + b;
}
template <typename F>
constexpr Vec<F>& operator-=(Vec<F>& a, Vec<F> b) {
  return a = a - b;
}

template <typename F>
constexpr F dot(Vec<F> a, Vec<F> b) {
  return a.x * b.x + a.y * b.y;
}
template <typename F>
constexpr F cross(Vec<F> a, Vec<F> b) {
  return a.x * b.y - a.y * b.x;
}
template <typename F>
constexpr Vec<F> cross(Vec<F> a, F s) {
  return {s * a.y, -(s * a.x)};
}
template <typename F>
constexpr Vec<F> cross(F s, Vec<F> a) {
  return {-(s * a.y), s * a.x};
}

inline float length(Vec2 a) { return std::sqrt(a.x * a.x + a.y * a.y); }

// Makes `a` a unit vector and returns the length it had; one too short to have a direction stays.
inline float normalize(Vec2& a) {
  const float norm = length(a);
  if (norm < kEpsilon) return 0.0f;
  const float inverse = 1.0f / norm;
  a.x *= inverse;
  a.y *= inverse;
  return norm;
}

// Not std::min and std::max: of two zeros that differ in sign, the second is taken. So do the
// instructions that lanes have for this (lanes.hpp).
constexpr float smaller(float a, float b) { return a < b ? a : b; }
constexpr float larger(float a, float b) { return a > b ? a : b; }
template <typename F>
constexpr F clamp(F a, F low, F high) {
  return larger(low, smaller(a, high));
}
constexpr float magnitude(float a) { return a > 0.0f ? a : -a; }

constexpr Vec2 smaller(Vec2 a, Vec2 b) { return {smaller(a.x, b.x), smaller(a.y, b.y)}; }
constexpr Vec2 larger(Vec2 a, Vec2 b) { return {larger(a.x, b.x), larger(a.y, b.y)}; }

struct Rotation {
  float sin;
  float cos;
};

inline Rotation rotation(float angle) { return {std::sin(angle), std::cos(angle)}; }

constexpr Vec2 rotate(Rotation q, Vec2 v) {
  return {q.cos * v.x - q.sin * v.y, q.sin * v.x + q.cos * v.y};
}
constexpr Vec2 rotate_back(Rotation q, Vec2 v) {
  return {q.cos * v.x + q.sin * v.y, -q.sin * v.x + q.cos * v.y};
}

// Where a body's own coordinates lie in the world.
struct Transform {
  Vec2 origin;
  Rotation rotation;
};

// The moon's. Nothing that multiplies by its zeros is left out, for a zero has a sign.
inline constexpr Transform kMoonTransform{{0.0f, 0.0f}, {0.0f, 1.0f}};

// The transform of a body whose centre of mass, `local_center` in its own coordinates, is there.
constexpr Transform transform_about(Vec2 center, Rotation q, Vec2 local_center) {
  return {center - rotate(q, local_center), q};
}

constexpr Vec2 to_world(const Transform& t, Vec2 v) {
  return {(t.rotation.cos * v.x - t.rotation.sin * v.y) + t.origin.x,
          (t.rotation.sin * v.x + t.rotation.cos * v.y) + t.origin.y};
}
constexpr Vec2 to_local(const Transform& t, Vec2 v) {
  return rotate_back(t.rotation, v - t.origin);
}

// Takes b's coordinates to a's.
constexpr Transform relative(const Transform& a, const Transform& b) {
  const Rotation p = a.rotation;
  const Rotation q = b.rotation;
  return {rotate_back(p, b.origin - a.origin),
          {p.cos * q.sin - p.sin * q.cos, p.cos * q.cos + p.sin * q.sin}};
}

// An upright box around a shape; pairs of boxes that overlap are looked at more closely.
struct Box {
  Vec2 lower;
  Vec2 upper;
};

constexpr Box grown(const Box& box, float margin) {
  const Vec2 r{margin, margin};
  return {box.lower - r, box.upper + r};
}
constexpr bool overlap(const Box& a, const Box& b) {
  return !(b.lower.x > a.upper.x || b.lower.y > a.upper.y || a.lower.x > b.upper.x ||
           a.lower.y > b.upper.y);
}
constexpr bool contains(const Box& outer, const Box& inner) {
  return outer.lower.x <= inner.lower.x && outer.lower.y <= inner.lower.y &&
         inner.upper.x <= outer.upper.x && inner.upper.y <= outer.upper.y;
}
constexpr Box around(const Box& a, const Box& b) {
  return {smaller(a.lower, b.lower), larger(a.upper, b.upper)};
}

}  // namespace touchdown
