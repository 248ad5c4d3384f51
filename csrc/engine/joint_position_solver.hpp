// One position iteration of a joint, for one environment or for one environment per lane.
//
// Box2D: b2RevoluteJoint::SolvePositionConstraints, and b2RevoluteJointDef (JointDefinition).
#pragma once

#include "engine/lanes.hpp"
#include "engine/math.hpp"
#include "engine/motion.hpp"
#include "engine/settings.hpp"
#include "engine/velocity_constraints.hpp"

namespace touchdown::engine {

// What the joint was made with.
struct JointDefinition {
  int leg;
  Vec2 hull_anchor;  // from the centre of mass
  Vec2 leg_anchor;   // from the centre of mass
  float reference_angle;
  float lower_angle;
  float upper_angle;
  float motor_speed;
};

// Moves the bodies back where the angle is beyond a limit or the anchors have drifted apart.
// Returns whether both errors were small.
template <typename F>
inline auto solve_position_constraint(const BasicJointConstraint<F>& constraint,
                                      const JointDefinition& definition, BasicPoses<F>& poses) {
  BasicPose<F>& a = poses[kHull];
  BasicPose<F>& b = poses[constraint.leg];
  const F ma = constraint.hull_inverse_mass;
  const F mb = constraint.leg_inverse_mass;
  const F ia = constraint.hull_inverse_inertia;
  const F ib = constraint.leg_inverse_inertia;

  F angular_error{};
  const auto at_limit = constraint.limit_floor == 0.0f;
  if (any(at_limit)) {
    const F angle = b.angle - a.angle - definition.reference_angle;
    const F past_lower = angle - definition.lower_angle;
    const F past_upper = angle - definition.upper_angle;
    const F zero{};
    const F most = broadcast<F>(kMaxAngularCorrection);
    const auto is_lower = constraint.limit_side > 0.0f;
    const F correction = is_lower ? clamp(past_lower + kAngularSlop, -most, zero)
                                  : clamp(past_upper - kAngularSlop, zero, most);
    const F impulse = -constraint.motor_mass * correction;
    angular_error = is_lower ? -past_lower : past_upper;
    angular_error = at_limit ? angular_error : zero;
    a.angle = at_limit ? a.angle - ia * impulse : a.angle;
    b.angle = at_limit ? b.angle + ib * impulse : b.angle;
  }

  const Vec<F> ra = rotate(rotation(a), broadcast<F>(definition.hull_anchor));
  const Vec<F> rb = rotate(rotation(b), broadcast<F>(definition.leg_anchor));
  const Vec<F> gap = b.center + rb - a.center - ra;

  const F xx = ma + mb + ia * ra.y * ra.y + ib * rb.y * rb.y;
  const F xy = -ia * ra.x * ra.y - ib * rb.x * rb.y;
  const F yy = ma + mb + ia * ra.x * ra.x + ib * rb.x * rb.x;
  const F determinant = xx * yy - xy * xy;
  const F inverse = determinant != 0.0f ? 1.0f / determinant : determinant;
  const Vec<F> impulse =
      -Vec<F>{inverse * (yy * gap.x - xy * gap.y), inverse * (xx * gap.y - xy * gap.x)};

  a.center -= ma * impulse;
  a.angle -= ia * cross(ra, impulse);
  b.center += mb * impulse;
  b.angle += ib * cross(rb, impulse);
  return length(gap) <= kLinearSlop && angular_error <= kAngularSlop;
}

}  // namespace touchdown::engine
