// Contacts as rows: what prepares them, iterates them and writes their impulses back.
//
// The moon does not move, so its half of every equation is gone. To take away its velocity, a zero
// of either sign, would change nothing but a velocity of -0, and there is none: velocities start at
// +0, and a sum is -0 only if both its terms are.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "bodies.hpp"
#include "contacts.hpp"
#include "coverage.hpp"
#include "motion.hpp"
#include "rows.hpp"
#include "terrain.hpp"

namespace touchdown {

using ContactPointRow = BasicContactPointRow<float>;
using ContactRow = BasicContactRow<float>;

// One contact as the position iterations see it.
struct ContactPositionRow {
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

inline ContactPositionRow prepare_position(const Contact& contact) {
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

// Where a manifold's points are in the world: half way between the two skins.
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
    const Vec2 on_face = point + (kSkin - dot(point - plane, normal)) * normal;
    const Vec2 on_other = point - kSkin * normal;
    placed.points[i] = 0.5f * (on_face + on_other);
  }
  placed.normal = on_edge ? normal : -normal;
  return placed;
}

inline ContactRow prepare(const Contact& contact, const Terrain& terrain, Poses& poses,
                          bool warm_start) {
  const Shape& shape = kShapes[contact.body];
  Pose& pose = poses[contact.body];
  const Manifold& manifold = contact.manifold;
  const float mass = shape.inverse_mass;
  const float inertia = shape.inverse_inertia;
  const WorldManifold placed = place(manifold, transform_of(pose, shape.local_center));

  ContactRow row{};
  row.body = contact.body;
  row.num_points = static_cast<int>(manifold.count);
  row.inverse_mass = mass;
  row.inverse_inertia = inertia;
  row.friction = std::sqrt(terrain.edges[contact.edge].friction * shape.friction);
  row.normal = placed.normal;
  row.tangent = cross(row.normal, 1.0f);
  std::array<float, 2> lever{};
  for (int i = 0; i < row.num_points; ++i) {
    ContactPointRow& point = row.points[i];
    point.arm = placed.points[i] - pose.center;
    lever[i] = cross(point.arm, row.normal);
    const float k_normal = mass + inertia * lever[i] * lever[i];
    point.normal_mass = k_normal > 0.0f ? 1.0f / k_normal : 0.0f;
    const float tangent_lever = cross(point.arm, row.tangent);
    const float k_tangent = mass + inertia * tangent_lever * tangent_lever;
    point.tangent_mass = k_tangent > 0.0f ? 1.0f / k_tangent : 0.0f;
    if (warm_start) {
      point.normal_impulse = manifold.points[i].normal_impulse;
      point.tangent_impulse = manifold.points[i].tangent_impulse;
    }
  }
  if (row.num_points == 2) {
    row.k11 = mass + inertia * lever[0] * lever[0];
    row.k22 = mass + inertia * lever[1] * lever[1];
    row.k12 = mass + inertia * lever[0] * lever[1];
    float determinant = row.k11 * row.k22 - row.k12 * row.k12;
    if (row.k11 * row.k11 < 1000.0f * determinant) {
      if (determinant != 0.0f) determinant = 1.0f / determinant;
      row.m11 = determinant * row.k22;
      row.m12 = -determinant * row.k12;
      row.m22 = determinant * row.k11;
    } else {
      row.num_points = 1;  // the points nearly coincide: the matrix has no useful inverse
    }
  }
  return row;
}

inline void warm_start(const ContactRow& row, Velocities& velocities) {
  Velocity& body = velocities[row.body];
  for (int i = 0; i < row.num_points; ++i) {
    const ContactPointRow& point = row.points[i];
    const Vec2 p = point.normal_impulse * row.normal + point.tangent_impulse * row.tangent;
    body.angular += row.inverse_inertia * cross(point.arm, p);
    body.linear += row.inverse_mass * p;
  }
}

inline void write_back(const ContactRow& row, Manifold& manifold) {
  for (int i = 0; i < row.num_points; ++i) {
    manifold.points[i].normal_impulse = row.points[i].normal_impulse;
    manifold.points[i].tangent_impulse = row.points[i].tangent_impulse;
  }
}

// Pushes the body out of the edge by a share of the overlap, point after point. Returns the least
// separation met, or zero.
inline float iterate_position(const ContactPositionRow& row, Poses& poses, float share) {
  constexpr float max_correction = 0.2f;  // metres
  Pose& pose = poses[row.body];
  float least = 0.0f;
  for (int i = 0; i < row.num_points; ++i) {
    const Transform body = transform_of(pose, row.local_center);
    const bool on_edge = row.face == Face::kEdge;
    const Transform& face = on_edge ? kMoonTransform : body;
    const Transform& other = on_edge ? body : kMoonTransform;
    Vec2 normal = rotate(face.rotation, row.local_normal);
    const Vec2 plane = to_world(face, row.local_point);
    const Vec2 point = to_world(other, row.local_points[i]);
    const float separation = dot(point - plane, normal) - kSkin - kSkin;
    if (!on_edge) normal = -normal;

    least = smaller(least, separation);
    const float correction = clamp(share * (separation + kLinearSlop), -max_correction, 0.0f);
    const Vec2 arm = point - pose.center;
    const float lever = cross(arm, normal);
    const float k = row.inverse_mass + row.inverse_inertia * lever * lever;
    const float impulse = k > 0.0f ? -correction / k : 0.0f;
    const Vec2 p = impulse * normal;
    pose.center += row.inverse_mass * p;
    pose.angle += row.inverse_inertia * cross(arm, p);
  }
  return least;
}

}  // namespace touchdown
