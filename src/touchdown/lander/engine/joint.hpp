// The hinge between the hull and a leg: a point that both share, a motor that pushes the leg out,
// and limits to the angle.
//
// The method is sequential impulses (E. Catto, "Iterative Dynamics with Temporal Coherence", 2005):
// each row cancels its own error in turn, again and again, and remembers the sum of its impulses.
#pragma once

#include <array>
#include <cstdint>

#include "bodies.hpp"
#include "motion.hpp"

namespace touchdown {

inline constexpr float kAngularSlop = 2.0f / 180.0f * kPi;
inline constexpr float kMaxAngularCorrection = 8.0f / 180.0f * kPi;
inline constexpr float kMaxMotorImpulse = kTimeStep * 40.0f;  // of a torque of 40 N m

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

// One joint as the velocity iterations see it: constants of the step, then the sums they change.
struct JointRow {
  int leg;
  float hull_inverse_mass, leg_inverse_mass;
  float hull_inverse_inertia, leg_inverse_inertia;
  Vec2 hull_arm, leg_arm;  // from the centres of mass to the hinge
  // The symmetric matrix that takes impulses (x, y, turn) to changes of relative velocity.
  float xx, xy, yy, xz, yz, zz;
  float yz_cross_x, yz_cross_y, yz_cross_z;  // the cross product of its second and third columns
  float inverse_determinant_2;               // of the upper two rows and columns
  float inverse_determinant_3;
  float motor_mass;
  float motor_speed;
  Limit limit;

  Vec2 impulse;
  float limit_impulse;
  float motor_impulse;
};

// Sets up the row where the bodies now are, and applies last step's impulses once more.
inline JointRow prepare(Joint& joint, const JointShape& shape, const Poses& poses,
                        Velocities& velocities) {
  JointRow row{};
  row.leg = shape.leg;
  const float ma = row.hull_inverse_mass = kShapes[kHull].inverse_mass;
  const float mb = row.leg_inverse_mass = kShapes[shape.leg].inverse_mass;
  const float ia = row.hull_inverse_inertia = kShapes[kHull].inverse_inertia;
  const float ib = row.leg_inverse_inertia = kShapes[shape.leg].inverse_inertia;
  const Pose& hull = poses[kHull];
  const Pose& leg = poses[shape.leg];
  const Vec2 ra = row.hull_arm = rotate(rotation(hull.angle), shape.hull_anchor);
  const Vec2 rb = row.leg_arm = rotate(rotation(leg.angle), shape.leg_anchor);

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
  row.inverse_determinant_3 = determinant_3 != 0.0f ? 1.0f / determinant_3 : determinant_3;
  const float determinant_2 = row.xx * row.yy - row.xy * row.xy;
  row.inverse_determinant_2 = determinant_2 != 0.0f ? 1.0f / determinant_2 : determinant_2;

  const float angle = leg.angle - hull.angle - shape.reference_angle;
  const Limit limit = angle <= shape.lower_angle   ? Limit::kLower
                      : angle >= shape.upper_angle ? Limit::kUpper
                                                   : Limit::kNone;
  if (limit != joint.limit || limit == Limit::kNone) joint.limit_impulse = 0.0f;
  joint.limit = row.limit = limit;
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

// The impulse that makes the hinge's points move alike, whatever the turning.
inline Vec2 solve_point(const JointRow& row, Vec2 v) {
  return {row.inverse_determinant_2 * (row.yy * v.x - row.xy * v.y),
          row.inverse_determinant_2 * (row.xx * v.y - row.xy * v.x)};
}

inline void iterate_velocity(JointRow& row, Velocities& velocities) {
  Velocity a = velocities[kHull];
  Velocity b = velocities[row.leg];
  const float ma = row.hull_inverse_mass;
  const float mb = row.leg_inverse_mass;
  const float ia = row.hull_inverse_inertia;
  const float ib = row.leg_inverse_inertia;

  {
    const float error = b.angular - a.angular - row.motor_speed;
    const float before = row.motor_impulse;
    row.motor_impulse =
        clamp(before + -row.motor_mass * error, -kMaxMotorImpulse, kMaxMotorImpulse);
    const float impulse = row.motor_impulse - before;
    a.angular -= ia * impulse;
    b.angular += ib * impulse;
  }

  const Vec2 slip =
      b.linear + cross(b.angular, row.leg_arm) - a.linear - cross(a.angular, row.hull_arm);
  Vec2 impulse;
  float turn = 0.0f;
  if (row.limit == Limit::kNone) {
    impulse = solve_point(row, -slip);
    row.impulse += impulse;
    a.angular -= ia * cross(row.hull_arm, impulse);
    b.angular += ib * cross(row.leg_arm, impulse);
  } else {
    // Cramer's rule, and all three signs turned at the end.
    const float spin = b.angular - a.angular;
    const float d = row.inverse_determinant_3;
    impulse.x = -(d * (slip.x * row.yz_cross_x + slip.y * row.yz_cross_y + spin * row.yz_cross_z));
    impulse.y = -(d * (row.xx * (slip.y * row.zz - spin * row.yz) +
                       row.xy * (spin * row.xz - slip.x * row.zz) +
                       row.xz * (slip.x * row.yz - slip.y * row.xz)));
    turn = -(d * (row.xx * (row.yy * spin - row.yz * slip.y) +
                  row.xy * (row.yz * slip.x - row.xy * spin) +
                  row.xz * (row.xy * slip.y - row.yy * slip.x)));
    const float sum = row.limit_impulse + turn;
    const bool pulls = row.limit == Limit::kLower ? sum < 0.0f : sum > 0.0f;
    if (pulls) {
      // A stop can only push: it lets go, and the hinge makes up for what it no longer gives.
      impulse = solve_point(row, -slip + row.limit_impulse * Vec2{row.xz, row.yz});
      turn = -row.limit_impulse;
      row.limit_impulse = 0.0f;
    } else {
      row.limit_impulse = sum;
    }
    row.impulse += impulse;
    a.angular -= ia * (cross(row.hull_arm, impulse) + turn);
    b.angular += ib * (cross(row.leg_arm, impulse) + turn);
  }
  a.linear -= ma * impulse;
  b.linear += mb * impulse;
  velocities[kHull] = a;
  velocities[row.leg] = b;
}

inline void write_back(const JointRow& row, Joint& joint) {
  joint.impulse = row.impulse;
  joint.limit_impulse = row.limit_impulse;
  joint.motor_impulse = row.motor_impulse;
}

// Moves the bodies towards each other where the hinge has drifted apart or gone past its stop.
// Says whether the error was small already.
inline bool iterate_position(const JointRow& row, const JointShape& shape, Poses& poses) {
  Pose a = poses[kHull];
  Pose b = poses[row.leg];
  const float ma = row.hull_inverse_mass;
  const float mb = row.leg_inverse_mass;
  const float ia = row.hull_inverse_inertia;
  const float ib = row.leg_inverse_inertia;

  float angular_error = 0.0f;
  if (row.limit != Limit::kNone) {
    const float angle = b.angle - a.angle - shape.reference_angle;
    float correction;
    if (row.limit == Limit::kLower) {
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

  const Vec2 ra = rotate(rotation(a.angle), shape.hull_anchor);
  const Vec2 rb = rotate(rotation(b.angle), shape.leg_anchor);
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
  poses[kHull] = a;
  poses[row.leg] = b;
  return length(gap) <= kLinearSlop && angular_error <= kAngularSlop;
}

}  // namespace touchdown
