// The revolute joint between the hull and a leg: a shared point, a motor that pushes the leg
// outwards, and limits on the angle.
//
// Box2D: b2RevoluteJoint, b2RevoluteJointDef (JointDefinition) and b2LimitState. Its
// iterations are in joint_velocity_solver.hpp and joint_position_solver.hpp.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "engine/joint_constants.hpp"
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

// A constraint without the constants and the warm start of joint_constants.hpp. Updates the limit.
inline JointConstraint prepare(Joint& joint, const JointDefinition& definition,
                               const Poses& poses) {
  const float angle = poses[definition.leg].angle - poses[kHull].angle - definition.reference_angle;
  const LimitState limit = angle <= definition.lower_angle   ? LimitState::kLower
                           : angle >= definition.upper_angle ? LimitState::kUpper
                                                             : LimitState::kNone;
  if (limit != joint.limit || limit == LimitState::kNone) joint.limit_impulse = 0.0f;
  joint.limit = limit;
  JointConstraint c{};
  c.leg = definition.leg;
  c.at_limit = limit != LimitState::kNone;
  c.limit_side = limit == LimitState::kUpper ? -1.0f : 1.0f;
  c.limit_floor = c.at_limit ? 0.0f : std::numeric_limits<float>::infinity();
  c.impulse = joint.impulse;
  c.limit_impulse = joint.limit_impulse;
  c.motor_impulse = joint.motor_impulse;
  set_masses(c, kShapes[kHull], kShapes[definition.leg]);
  return c;
}

// The constraint at the bodies' current poses. Applies last step's impulses.
inline JointConstraint prepare(Joint& joint, const JointDefinition& definition, Poses& poses,
                               Velocities& velocities) {
  JointConstraint constraint = prepare(joint, definition, poses);
  set_constants(constraint, definition, poses);
  warm_start(constraint, velocities);
  return constraint;
}

inline void store_impulses(const JointConstraint& constraint, Joint& joint) {
  joint.impulse = constraint.impulse;
  joint.limit_impulse = constraint.limit_impulse;
  joint.motor_impulse = constraint.motor_impulse;
}

}  // namespace touchdown::engine
