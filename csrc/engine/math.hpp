// Plane geometry in single precision: vectors, rotations, transforms.
//
// Box2D: b2Math.h (b2Vec2, b2Rot, b2Transform, b2Mul, b2MulT). Every expression is part of the
// promise that a flight equals stock Gymnasium's bit for bit: the order of operations and the
// treatment of equal arguments are fixed, and sine and cosine have the C library's bits.
#pragma once

#include <cfloat>
#include <cmath>

#include "engine/lanes.hpp"

namespace touchdown::engine {

inline constexpr float kEpsilon = FLT_EPSILON;

// `F` is a float or a vector of floats, one per lane (lanes.hpp).
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

// The same vector in every lane.
template <typename F>
constexpr Vec<F> broadcast(Vec2 a) {
  return {broadcast<F>(a.x), broadcast<F>(a.y)};
}

template <typename Mask, typename F>
constexpr Vec<F> select(Mask condition, Vec<F> a, Vec<F> b) {
  return {pick(condition, a.x, b.x), pick(condition, a.y, b.y)};
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

template <typename F>
inline F length(Vec<F> a) {
  return root(a.x * a.x + a.y * a.y);
}

// Makes `a` a unit vector and returns its former length; a vector too short to have a direction
// stays.
inline float normalize(Vec2& a) {
  const float norm = length(a);
  if (norm < kEpsilon) return 0.0f;
  const float inverse = 1.0f / norm;
  a.x *= inverse;
  a.y *= inverse;
  return norm;
}

// Not std::min and std::max: of two zeros that differ in sign, the second is taken, as the vector
// instructions do (lanes.hpp).
constexpr float smaller(float a, float b) { return a < b ? a : b; }
constexpr float larger(float a, float b) { return a > b ? a : b; }
template <typename F>
constexpr F clamp(F a, F low, F high) {
  return larger(low, smaller(a, high));
}
template <typename F>
constexpr F magnitude(F a) {
  return a > 0.0f ? a : -a;
}

template <typename F>
constexpr Vec<F> smaller(Vec<F> a, Vec<F> b) {
  return {smaller(a.x, b.x), smaller(a.y, b.y)};
}
template <typename F>
constexpr Vec<F> larger(Vec<F> a, Vec<F> b) {
  return {larger(a.x, b.x), larger(a.y, b.y)};
}

template <typename F>
struct BasicRotation {
  F sin;
  F cos;
};
using Rotation = BasicRotation<float>;

inline Rotation rotation(float angle) { return {std::sin(angle), std::cos(angle)}; }

template <typename F>
constexpr Vec<F> rotate(BasicRotation<F> q, Vec<F> v) {
  return {q.cos * v.x - q.sin * v.y, q.sin * v.x + q.cos * v.y};
}
constexpr Vec2 rotate_back(Rotation q, Vec2 v) {
  return {q.cos * v.x + q.sin * v.y, -q.sin * v.x + q.cos * v.y};
}

// From a body's own coordinates to the world's.
template <typename F>
struct BasicTransform {
  Vec<F> origin;
  BasicRotation<F> rotation;
};
using Transform = BasicTransform<float>;

// The moon's. Multiplications by its zeros are not left out, because a zero has a sign.
inline constexpr Transform kMoonTransform{{0.0f, 0.0f}, {0.0f, 1.0f}};

// The transform of a body whose centre of mass, `local_center` in its own coordinates, is at
// `center`.
template <typename F>
constexpr BasicTransform<F> transform_about(Vec<F> center, BasicRotation<F> q,
                                            Vec<F> local_center) {
  return {center - rotate(q, local_center), q};
}

template <typename F>
constexpr Vec<F> to_world(const BasicTransform<F>& t, Vec<F> v) {
  return {(t.rotation.cos * v.x - t.rotation.sin * v.y) + t.origin.x,
          (t.rotation.sin * v.x + t.rotation.cos * v.y) + t.origin.y};
}
constexpr Vec2 to_local(const Transform& t, Vec2 v) {
  return rotate_back(t.rotation, v - t.origin);
}

// From b's coordinates to a's (b2MulT).
constexpr Transform relative(const Transform& a, const Transform& b) {
  const Rotation p = a.rotation;
  const Rotation q = b.rotation;
  return {rotate_back(p, b.origin - a.origin),
          {p.cos * q.sin - p.sin * q.cos, p.cos * q.cos + p.sin * q.sin}};
}

}  // namespace touchdown::engine
