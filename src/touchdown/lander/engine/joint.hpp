// The hinge between the hull and a leg: a point that both share, a motor that pushes the leg out,
// and limits to the angle.
#pragma once

#include <array>
#include <cstdint>

#include "bodies.hpp"
#include "motion.hpp"
#include "rows.hpp"

namespace touchdown {

inline constexpr float kAngularSlop = 2.0f / 180.0f * kPi;
inline constexpr float kMaxAngularCorrection = 8.0f / 180.0f * kPi;

enum class Limit : std::uint32_t { kNone, kLower, kUpper };

// What a joint remembers from step to step.
struct Joint {
  Vec2 impulse;
  float limit_impulse;
  float motor_impulse;
  Limit limit;
};

// How a joint was made.
struct JointShape {
  int leg;
  Vec2 hull_anchor;  // from the centre of mass
  Vec2 leg_anchor;   // from the centre of mass
  float reference_angle;
  float lower_angle;
  float upper_angle;
  float motor_speed;
};

inline JointShape make_joint_shape(int leg) {
  const double side = leg == kLeg0 ? -1.0 : 1.0;
  const Vec2 leg_anchor{static_cast<float>(side * 20 / kScale), static_cast<float>(18 / kScale)};
  JointShape shape{};
  shape.leg = leg;
  shape.hull_anchor = Vec2{0.0f, 0.0f} - kShapes[kHull].local_center;
  shape.leg_anchor = leg_anchor - kShapes[leg].local_center;
  shape.reference_angle = static_cast<float>(side * 0.05);  // the leg's angle when it is hung on
  shape.lower_angle = static_cast<float>(leg == kLeg0 ? 0.9 - 0.5 : -0.9);
  shape.upper_angle = static_cast<float>(leg == kLeg0 ? 0.9 : -0.9 + 0.5);
  shape.motor_speed = static_cast<float>(0.3 * side);
  return shape;
}

inline const std::array<JointShape, kNumLegs> kJointShapes = {make_joint_shape(kLeg0),
                                                              make_joint_shape(kLeg1)};

using JointRow = BasicJointRow<float>;

// Sets up the row where the bodies now are, and applies last step's impulses once more.
inline JointRow prepare(Joint& joint, const JointShape& shape, Poses& poses, Velocities& velocities) {
  JointRow row{};
  row.leg = shape.leg;
  const float ma = row.hull_inverse_mass = kShapes[kHull].inverse_mass;
  const float mb = row.leg_inverse_mass = kShapes[shape.leg].inverse_mass;
  const float ia = row.hull_inverse_inertia = kShapes[kHull].inverse_inertia;
  const float ib = row.leg_inverse_inertia = kShapes[shape.leg].inverse_inertia;
  Pose& hull = poses[kHull];
  Pose& leg = poses[shape.leg];
  const Vec2 ra = row.hull_arm = rotate(rotation(hull), shape.hull_anchor);
  const Vec2 rb = row.leg_arm = rotate(rotation(leg), shape.leg_anchor);

  row.xx = ma + mb + ra.y * ra.y * ia + rb.y * rb.y * ib;
  row.xy = -ra.y * ra.x * ia - rb.y * rb.x * ib;
  row.xz = -ra.y * ia - rb.y * ib;
  row.yy = ma + mb + ra.x * ra.x * ia + rb.x * rb.x * ib;
  row.yz = ra.x * ia + rb.x * ib;
  row.zz = ia + ib;
  row.motor_mass = 1.0f / row.zz;
  row.motor_speed = shape.motor_speed;

  row.yz_cross_x = row.yy * row.zz - row.yz * row.yz;
  row.yz_cross_y = row.yz * row.xz - row.xy * row.zz;
  row.yz_cross_z = row.xy * row.yz - row.yy * row.xz;
  const float determinant_3 =
      row.xx * row.yz_cross_x + row.xy * row.yz_cross_y + row.xz * row.yz_cross_z;
  row.minus_inverse_determinant_3 = -(determinant_3 != 0.0f ? 1.0f / determinant_3 : determinant_3);
  const float determinant_2 = row.xx * row.yy - row.xy * row.xy;
  row.inverse_determinant_2 = determinant_2 != 0.0f ? 1.0f / determinant_2 : determinant_2;

  const float angle = leg.angle - hull.angle - shape.reference_angle;
  const Limit limit = angle <= shape.lower_angle   ? Limit::kLower
                      : angle >= shape.upper_angle ? Limit::kUpper
                                                   : Limit::kNone;
  if (limit != joint.limit || limit == Limit::kNone) joint.limit_impulse = 0.0f;
  joint.limit = limit;
  row.at_stop = limit != Limit::kNone;
  row.stop_side = limit == Limit::kUpper ? -1.0f : 1.0f;
  row.impulse = joint.impulse;
  row.limit_impulse = joint.limit_impulse;
  row.motor_impulse = joint.motor_impulse;

  Velocity& a = velocities[kHull];
  Velocity& b = velocities[shape.leg];
  const Vec2 p = row.impulse;
  a.linear -= ma * p;
  a.angular -= ia * (cross(ra, p) + row.motor_impulse + row.limit_impulse);
  b.linear += mb * p;
  b.angular += ib * (cross(rb, p) + row.motor_impulse + row.limit_impulse);
  return row;
}

inline void write_back(const JointRow& row, Joint& joint) {
  joint.impulse = row.impulse;
  joint.limit_impulse = row.limit_impulse;
  joint.motor_impulse = row.motor_impulse;
}

// Moves the bodies towards each other where the hinge has drifted apart or gone past its stop.
// Says whether the error was small already.
inline bool iterate_position(const JointRow& row, const JointShape& shape, Poses& poses) {
  Pose& a = poses[kHull];
  Pose& b = poses[row.leg];
  const float ma = row.hull_inverse_mass;
  const float mb = row.leg_inverse_mass;
  const float ia = row.hull_inverse_inertia;
  const float ib = row.leg_inverse_inertia;

  float angular_error = 0.0f;
  if (row.at_stop) {
    const float angle = b.angle - a.angle - shape.reference_angle;
    float correction;
    if (row.stop_side > 0.0f) {
      const float past = angle - shape.lower_angle;
      angular_error = -past;
      correction = clamp(past + kAngularSlop, -kMaxAngularCorrection, 0.0f);
    } else {
      const float past = angle - shape.upper_angle;
      angular_error = past;
      correction = clamp(past - kAngularSlop, 0.0f, kMaxAngularCorrection);
    }
    const float impulse = -row.motor_mass * correction;
    a.angle -= ia * impulse;
    b.angle += ib * impulse;
  }

  const Vec2 ra = rotate(rotation(a), shape.hull_anchor);
  const Vec2 rb = rotate(rotation(b), shape.leg_anchor);
  const Vec2 gap = b.center + rb - a.center - ra;

  const float xx = ma + mb + ia * ra.y * ra.y + ib * rb.y * rb.y;
  const float xy = -ia * ra.x * ra.y - ib * rb.x * rb.y;
  const float yy = ma + mb + ia * ra.x * ra.x + ib * rb.x * rb.x;
  float inverse = xx * yy - xy * xy;
  if (inverse != 0.0f) inverse = 1.0f / inverse;
  const Vec2 impulse =
      -Vec2{inverse * (yy * gap.x - xy * gap.y), inverse * (xx * gap.y - xy * gap.x)};

  a.center -= ma * impulse;
  a.angle -= ia * cross(ra, impulse);
  b.center += mb * impulse;
  b.angle += ib * cross(rb, impulse);
  return length(gap) <= kLinearSlop && angular_error <= kAngularSlop;
}

}  // namespace touchdown
