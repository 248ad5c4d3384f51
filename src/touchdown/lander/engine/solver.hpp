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
#include "terrain.hpp"

namespace touchdown {

struct ContactPointRow {
  Vec2 arm;  // from the body's centre of mass
  float normal_mass;
  float tangent_mass;
  float normal_impulse;
  float tangent_impulse;
};

// One contact as the velocity iterations see it.
struct ContactRow {
  int body;
  int num_points;
  float inverse_mass;
  float inverse_inertia;
  float friction;
  Vec2 normal;  // from the moon to the body
  Vec2 tangent;
  std::array<ContactPointRow, 2> points;
  // For two points: the symmetric matrix from normal impulses to normal velocities, and back.
  float k11, k12, k22;
  float m11, m12, m22;
  std::uint32_t cases_seen;
};

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

inline ContactRow prepare(const Contact& contact, const Terrain& terrain, const Poses& poses,
                          bool warm_start) {
  const Shape& shape = kShapes[contact.body];
  const Pose& pose = poses[contact.body];
  const Manifold& manifold = contact.manifold;
  const float mass = shape.inverse_mass;
  const float inertia = shape.inverse_inertia;
  const WorldManifold placed =
      place(manifold, transform_about(pose.center, pose.angle, shape.local_center));

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

inline Vec2 velocity_at(const ContactPointRow& point, const Velocity& body) {
  return body.linear + cross(body.angular, point.arm);
}

// Both normal impulses at once: the linear complementarity problem of two points, by trying its
// four cases (K. Murty's total enumeration), each of which a velocity or an impulse of zero ends.
inline void iterate_two_points(ContactRow& row, Velocity& body) {
  ContactPointRow& first = row.points[0];
  ContactPointRow& second = row.points[1];
  const Vec2 before{first.normal_impulse, second.normal_impulse};
  // What the normal velocities would be without any impulse of these two.
  const Vec2 free =
      Vec2{dot(velocity_at(first, body), row.normal), dot(velocity_at(second, body), row.normal)} -
      Vec2{row.k11 * before.x + row.k12 * before.y, row.k12 * before.x + row.k22 * before.y};

  Vec2 after = -Vec2{row.m11 * free.x + row.m12 * free.y, row.m12 * free.x + row.m22 * free.y};
  BlockCase block_case = BlockCase::kBothPush;
  if (!(after.x >= 0.0f && after.y >= 0.0f)) {
    const float alone_first = -first.normal_mass * free.x;
    const float alone_second = -second.normal_mass * free.y;
    if (alone_first >= 0.0f && row.k12 * alone_first + free.y >= 0.0f) {
      block_case = BlockCase::kFirstPushes;
      after = {alone_first, 0.0f};
    } else if (alone_second >= 0.0f && row.k12 * alone_second + free.x >= 0.0f) {
      block_case = BlockCase::kSecondPushes;
      after = {0.0f, alone_second};
    } else if (free.x >= 0.0f && free.y >= 0.0f) {
      block_case = BlockCase::kNeitherPushes;
      after = {0.0f, 0.0f};
    } else {
      row.cases_seen |= 1u << static_cast<int>(BlockCase::kNoSolution);
      return;  // rounding left no case: the impulses stay, and the next iteration tries again
    }
  }
  row.cases_seen |= 1u << static_cast<int>(block_case);

  const Vec2 change = after - before;
  const Vec2 p1 = change.x * row.normal;
  const Vec2 p2 = change.y * row.normal;
  body.linear += row.inverse_mass * (p1 + p2);
  body.angular += row.inverse_inertia * (cross(first.arm, p1) + cross(second.arm, p2));
  first.normal_impulse = after.x;
  second.normal_impulse = after.y;
}

inline void iterate_velocity(ContactRow& row, Velocities& velocities) {
  Velocity body = velocities[row.body];
  // Friction first, bounded by the last normal impulse: that nothing sinks in matters more.
  for (int i = 0; i < row.num_points; ++i) {
    ContactPointRow& point = row.points[i];
    const float slip = dot(velocity_at(point, body), row.tangent);
    const float bound = row.friction * point.normal_impulse;
    const float before = point.tangent_impulse;
    point.tangent_impulse = clamp(before + point.tangent_mass * -slip, -bound, bound);
    const Vec2 p = (point.tangent_impulse - before) * row.tangent;
    body.linear += row.inverse_mass * p;
    body.angular += row.inverse_inertia * cross(point.arm, p);
  }
  if (row.num_points == 1) {
    ContactPointRow& point = row.points[0];
    const float approach = dot(velocity_at(point, body), row.normal);
    const float before = point.normal_impulse;
    point.normal_impulse = larger(before + -point.normal_mass * approach, 0.0f);
    const Vec2 p = (point.normal_impulse - before) * row.normal;
    body.linear += row.inverse_mass * p;
    body.angular += row.inverse_inertia * cross(point.arm, p);
  } else {
    iterate_two_points(row, body);
  }
  velocities[row.body] = body;
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
  Pose pose = poses[row.body];
  float least = 0.0f;
  for (int i = 0; i < row.num_points; ++i) {
    const Transform body = transform_about(pose.center, pose.angle, row.local_center);
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
  poses[row.body] = pose;
  return least;
}

}  // namespace touchdown
