// Contact constraints: preparing them, warm starting, storing impulses, and correcting positions.
//
// Box2D: b2ContactSolver (its constructor, InitializeVelocityConstraints, WarmStart, StoreImpulses,
// SolvePositionConstraints, SolveTOIPositionConstraints) and b2WorldManifold. The moon does not
// move, so its half of every equation is left out. Subtracting its velocity, a zero of either sign,
// could change only a velocity of -0, and there is none: velocities start at +0, and a sum is -0
// only if both of its terms are.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "engine/contact.hpp"
#include "engine/manifold.hpp"
#include "engine/math.hpp"
#include "engine/motion.hpp"
#include "engine/settings.hpp"
#include "engine/shapes.hpp"
#include "engine/terrain.hpp"
#include "engine/velocity_constraints.hpp"

namespace touchdown::engine {

using ContactPoint = BasicContactPoint<float>;
using ContactConstraint = BasicContactConstraint<float>;

// What the position iterations need of a contact (b2ContactPositionConstraint).
struct ContactPositionConstraint {
  int body;
  int num_points;
  Face face;
  float inverse_mass;
  float inverse_inertia;
  Vec2 local_center;
  Vec2 local_normal;
  Vec2 local_point;
  std::array<Vec2, 2> local_points;
};

inline ContactPositionConstraint prepare_position(const Contact& contact) {
  const Shape& shape = kShapes[contact.body];
  const Manifold& manifold = contact.manifold;
  return {contact.body,
          static_cast<int>(manifold.count),
          manifold.face,
          shape.inverse_mass,
          shape.inverse_inertia,
          shape.local_center,
          manifold.local_normal,
          manifold.local_point,
          {manifold.points[0].local_point, manifold.points[1].local_point}};
}

// A manifold's points in world coordinates, half way between the two skins.
struct WorldManifold {
  Vec2 normal;
  std::array<Vec2, 2> points;
};

inline WorldManifold place(const Manifold& manifold, const Transform& body) {
  WorldManifold placed{};
  const bool on_edge = manifold.face == Face::kEdge;
  const Transform& face = on_edge ? kMoonTransform : body;
  const Transform& other = on_edge ? body : kMoonTransform;
  const Vec2 normal = rotate(face.rotation, manifold.local_normal);
  const Vec2 plane = to_world(face, manifold.local_point);
  for (std::uint32_t i = 0; i < manifold.count; ++i) {
    const Vec2 point = to_world(other, manifold.points[i].local_point);
    const Vec2 on_face = point + (kPolygonRadius - dot(point - plane, normal)) * normal;
    const Vec2 on_other = point - kPolygonRadius * normal;
    placed.points[i] = 0.5f * (on_face + on_other);
  }
  placed.normal = on_edge ? normal : -normal;
  return placed;
}

// The constraint at the body's current pose; its impulses start from the manifold's if
// `warm_start`.
inline ContactConstraint prepare(const Contact& contact, const Terrain& terrain, Poses& poses,
                                 bool warm_start) {
  const Shape& shape = kShapes[contact.body];
  Pose& pose = poses[contact.body];
  const Manifold& manifold = contact.manifold;
  const float mass = shape.inverse_mass;
  const float inertia = shape.inverse_inertia;
  const WorldManifold placed = place(manifold, transform_of(pose, shape.local_center));

  ContactConstraint constraint{};
  constraint.body = contact.body;
  constraint.num_points = static_cast<int>(manifold.count);
  constraint.inverse_mass = mass;
  constraint.inverse_inertia = inertia;
  constraint.friction = std::sqrt(terrain.edges[contact.edge].friction * shape.friction);
  constraint.normal = placed.normal;
  constraint.tangent = cross(constraint.normal, 1.0f);
  std::array<float, 2> lever{};
  for (int i = 0; i < constraint.num_points; ++i) {
    ContactPoint& point = constraint.points[i];
    point.arm = placed.points[i] - pose.center;
    lever[i] = cross(point.arm, constraint.normal);
    const float k_normal = mass + inertia * lever[i] * lever[i];
    point.normal_mass = k_normal > 0.0f ? 1.0f / k_normal : 0.0f;
    const float tangent_lever = cross(point.arm, constraint.tangent);
    const float k_tangent = mass + inertia * tangent_lever * tangent_lever;
    point.tangent_mass = k_tangent > 0.0f ? 1.0f / k_tangent : 0.0f;
    if (warm_start) {
      point.normal_impulse = manifold.points[i].normal_impulse;
      point.tangent_impulse = manifold.points[i].tangent_impulse;
    }
  }
  if (constraint.num_points == 2) {
    constraint.k11 = mass + inertia * lever[0] * lever[0];
    constraint.k22 = mass + inertia * lever[1] * lever[1];
    constraint.k12 = mass + inertia * lever[0] * lever[1];
    float determinant = constraint.k11 * constraint.k22 - constraint.k12 * constraint.k12;
    if (constraint.k11 * constraint.k11 < 1000.0f * determinant) {
      if (determinant != 0.0f) determinant = 1.0f / determinant;
      constraint.m11 = determinant * constraint.k22;
      constraint.m12 = -determinant * constraint.k12;
      constraint.m22 = determinant * constraint.k11;
    } else {
      constraint.num_points = 1;  // the points nearly coincide: K has no useful inverse
    }
  }
  return constraint;
}

// Applies last step's impulses.
inline void warm_start(const ContactConstraint& constraint, Velocities& velocities) {
  Velocity& body = velocities[constraint.body];
  for (int i = 0; i < constraint.num_points; ++i) {
    const ContactPoint& point = constraint.points[i];
    const Vec2 p =
        point.normal_impulse * constraint.normal + point.tangent_impulse * constraint.tangent;
    body.angular += constraint.inverse_inertia * cross(point.arm, p);
    body.linear += constraint.inverse_mass * p;
  }
}

inline void store_impulses(const ContactConstraint& constraint, Manifold& manifold) {
  for (int i = 0; i < constraint.num_points; ++i) {
    manifold.points[i].normal_impulse = constraint.points[i].normal_impulse;
    manifold.points[i].tangent_impulse = constraint.points[i].tangent_impulse;
  }
}

// One position iteration of a contact: pushes the body out of the edge by the share `baumgarte` of
// the overlap, point after point. Returns the smallest separation met, or zero if that is smaller.
inline float solve_position_constraint(const ContactPositionConstraint& constraint, Poses& poses,
                                       float baumgarte) {
  Pose& pose = poses[constraint.body];
  float min_separation = 0.0f;
  for (int i = 0; i < constraint.num_points; ++i) {
    const Transform body = transform_of(pose, constraint.local_center);
    const bool on_edge = constraint.face == Face::kEdge;
    const Transform& face = on_edge ? kMoonTransform : body;
    const Transform& other = on_edge ? body : kMoonTransform;
    Vec2 normal = rotate(face.rotation, constraint.local_normal);
    const Vec2 plane = to_world(face, constraint.local_point);
    const Vec2 point = to_world(other, constraint.local_points[i]);
    const float separation = dot(point - plane, normal) - kPolygonRadius - kPolygonRadius;
    if (!on_edge) normal = -normal;

    min_separation = smaller(min_separation, separation);
    const float correction =
        clamp(baumgarte * (separation + kLinearSlop), -kMaxLinearCorrection, 0.0f);
    const Vec2 arm = point - pose.center;
    const float lever = cross(arm, normal);
    const float k = constraint.inverse_mass + constraint.inverse_inertia * lever * lever;
    const float impulse = k > 0.0f ? -correction / k : 0.0f;
    const Vec2 p = impulse * normal;
    pose.center += constraint.inverse_mass * p;
    pose.angle += constraint.inverse_inertia * cross(arm, p);
  }
  return min_separation;
}

}  // namespace touchdown::engine
