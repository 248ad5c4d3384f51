// The revolute joint between the hull and a leg: a shared point, a motor that pushes the leg
// outwards, and limits on the angle.
//
// Box2D: b2RevoluteJoint, b2RevoluteJointDef (JointDefinition) and b2LimitState. Its
// iterations are in joint_velocity_solver.hpp and joint_position_solver.hpp.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "engine/joint_position_solver.hpp"
#include "engine/math.hpp"
#include "engine/motion.hpp"
#include "engine/settings.hpp"
#include "engine/shapes.hpp"
#include "engine/velocity_constraints.hpp"

namespace touchdown::engine {

enum class LimitState : std::uint32_t { kNone, kLower, kUpper };

// What a joint keeps from step to step: the accumulated impulses, for warm starting.
struct Joint {
  Vec2 impulse;
  float limit_impulse;
  float motor_impulse;
  LimitState limit;
};

inline JointDefinition make_joint_definition(int leg) {
  const double side = leg == kLeg0 ? -1.0 : 1.0;
  const Vec2 leg_anchor{static_cast<float>(side * 20 / kScale), static_cast<float>(18 / kScale)};
  JointDefinition definition{};
  definition.leg = leg;
  definition.hull_anchor = Vec2{0.0f, 0.0f} - kShapes[kHull].local_center;
  definition.leg_anchor = leg_anchor - kShapes[leg].local_center;
  // The leg's angle when the joint is made: pybox2d's default, where C++'s is 0.
  definition.reference_angle = static_cast<float>(side * 0.05);
  definition.lower_angle = static_cast<float>(leg == kLeg0 ? 0.9 - 0.5 : -0.9);
  definition.upper_angle = static_cast<float>(leg == kLeg0 ? 0.9 : -0.9 + 0.5);
  definition.motor_speed = static_cast<float>(0.3 * side);
  return definition;
}

inline const std::array<JointDefinition, kNumLegs> kJointDefinitions = {
    make_joint_definition(kLeg0), make_joint_definition(kLeg1)};

using JointConstraint = BasicJointConstraint<float>;

// The constraint at the bodies' current poses. Applies last step's impulses
// (b2RevoluteJoint::InitVelocityConstraints).
inline JointConstraint prepare(Joint& joint, const JointDefinition& definition, Poses& poses,
                               Velocities& velocities) {
  JointConstraint c{};
  c.leg = definition.leg;
  const float ma = c.hull_inverse_mass = kShapes[kHull].inverse_mass;
  const float mb = c.leg_inverse_mass = kShapes[definition.leg].inverse_mass;
  const float ia = c.hull_inverse_inertia = kShapes[kHull].inverse_inertia;
  const float ib = c.leg_inverse_inertia = kShapes[definition.leg].inverse_inertia;
  Pose& hull = poses[kHull];
  Pose& leg = poses[definition.leg];
  const Vec2 ra = c.hull_arm = rotate(rotation(hull), definition.hull_anchor);
  const Vec2 rb = c.leg_arm = rotate(rotation(leg), definition.leg_anchor);

  c.xx = ma + mb + ra.y * ra.y * ia + rb.y * rb.y * ib;
  c.xy = -ra.y * ra.x * ia - rb.y * rb.x * ib;
  c.xz = -ra.y * ia - rb.y * ib;
  c.yy = ma + mb + ra.x * ra.x * ia + rb.x * rb.x * ib;
  c.yz = ra.x * ia + rb.x * ib;
  c.zz = ia + ib;
  c.motor_mass = 1.0f / c.zz;
  c.motor_speed = definition.motor_speed;

  c.yz_cross_x = c.yy * c.zz - c.yz * c.yz;
  c.yz_cross_y = c.yz * c.xz - c.xy * c.zz;
  c.yz_cross_z = c.xy * c.yz - c.yy * c.xz;
  const float determinant_3 = c.xx * c.yz_cross_x + c.xy * c.yz_cross_y + c.xz * c.yz_cross_z;
  c.minus_inverse_determinant_3 = -(determinant_3 != 0.0f ? 1.0f / determinant_3 : determinant_3);
  const float determinant_2 = c.xx * c.yy - c.xy * c.xy;
  c.inverse_determinant_2 = determinant_2 != 0.0f ? 1.0f / determinant_2 : determinant_2;

  const float angle = leg.angle - hull.angle - definition.reference_angle;
  const LimitState limit = angle <= definition.lower_angle   ? LimitState::kLower
                           : angle >= definition.upper_angle ? LimitState::kUpper
                                                             : LimitState::kNone;
  if (limit != joint.limit || limit == LimitState::kNone) joint.limit_impulse = 0.0f;
  joint.limit = limit;
  c.at_limit = limit != LimitState::kNone;
  c.limit_side = limit == LimitState::kUpper ? -1.0f : 1.0f;
  c.limit_floor = c.at_limit ? 0.0f : std::numeric_limits<float>::infinity();
  if (!c.at_limit) c.xz = c.yz = -0.0f;
  c.impulse = joint.impulse;
  c.limit_impulse = joint.limit_impulse;
  c.motor_impulse = joint.motor_impulse;

  Velocity& a = velocities[kHull];
  Velocity& b = velocities[definition.leg];
  const Vec2 p = c.impulse;
  a.linear -= ma * p;
  a.angular -= ia * (cross(ra, p) + c.motor_impulse + c.limit_impulse);
  b.linear += mb * p;
  b.angular += ib * (cross(rb, p) + c.motor_impulse + c.limit_impulse);
  return c;
}

inline void store_impulses(const JointConstraint& constraint, Joint& joint) {
  joint.impulse = constraint.impulse;
  joint.limit_impulse = constraint.limit_impulse;
  joint.motor_impulse = constraint.motor_impulse;
}

}  // namespace touchdown::engine
