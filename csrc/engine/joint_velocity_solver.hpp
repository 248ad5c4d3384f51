// One velocity iteration of a revolute joint, for one environment or for one environment per lane.
//
// Box2D: b2RevoluteJoint::SolveVelocityConstraints. A lane that takes another branch than its
// neighbours is selected, never masked by adding a zero, because a zero has a sign.
#pragma once

#include "engine/lanes.hpp"
#include "engine/math.hpp"
#include "engine/settings.hpp"
#include "engine/velocity_constraints.hpp"

namespace touchdown::engine {

inline constexpr float kMaxMotorTorque = 40.0f;  // N m
inline constexpr float kMaxMotorImpulse = kTimeStep * kMaxMotorTorque;

// A negation is folded into the next operation only where that changes no bit: a + -b is a - b, and
// -a * b is -(a * b). But -(a - b) is not b - a: where a equals b, the signs of their zeros differ.

// The point impulse that changes the anchors' relative velocity by `v`, ignoring rotation
// (b2Mat33::Solve22).
template <typename F>
constexpr Vec<F> solve_point(const BasicJointConstraint<F>& joint, Vec<F> v) {
  return {joint.inverse_determinant_2 * (joint.yy * v.x - joint.xy * v.y),
          joint.inverse_determinant_2 * (joint.xx * v.y - joint.xy * v.x)};
}

// One velocity iteration of a joint: the motor, then the limit together with the point. Returns the
// impulse that the point constraint added; nothing reads its accumulated value within the step.
template <typename F>
[[gnu::always_inline]] inline Vec<F> solve_velocity_constraint(BasicJointConstraint<F>& joint,
                                                               BasicVelocities<F>& velocities,
                                                               int leg) {
  BasicVelocity<F> a = velocities[kHull];
  BasicVelocity<F> b = velocities[leg];
  const F ma = joint.hull_inverse_mass;
  const F mb = joint.leg_inverse_mass;
  const F ia = joint.hull_inverse_inertia;
  const F ib = joint.leg_inverse_inertia;

  {
    const F max_impulse = broadcast<F>(kMaxMotorImpulse);
    const F error = b.angular - a.angular - joint.motor_speed;
    const F before = joint.motor_impulse;
    joint.motor_impulse = clamp(before - joint.motor_mass * error, -max_impulse, max_impulse);
    const F impulse = joint.motor_impulse - before;
    a.angular -= ia * impulse;
    b.angular += ib * impulse;
  }

  const Vec<F> drift{
      b.linear.x - b.angular * joint.leg_arm.y - a.linear.x + a.angular * joint.hull_arm.y,
      b.linear.y + b.angular * joint.leg_arm.x - a.linear.y - a.angular * joint.hull_arm.x};
  Vec<F> impulse;
  if (!joint.at_limit) {
    // What `solve_point` gives for -drift.
    impulse = {joint.inverse_determinant_2 * (joint.xy * drift.y - joint.yy * drift.x),
               joint.inverse_determinant_2 * (joint.xy * drift.x - joint.xx * drift.y)};
    joint.impulse += impulse;
    a.angular -= ia * cross(joint.hull_arm, impulse);
    b.angular += ib * cross(joint.leg_arm, impulse);
  } else {
    // The angle and the point at once, by Cramer's rule (b2Mat33::Solve33).
    const F rotation_rate = b.angular - a.angular;
    const F d = joint.minus_inverse_determinant_3;
    impulse.x = d * (drift.x * joint.yz_cross_x + drift.y * joint.yz_cross_y +
                     rotation_rate * joint.yz_cross_z);
    impulse.y = d * (joint.xx * (drift.y * joint.zz - rotation_rate * joint.yz) +
                     joint.xy * (rotation_rate * joint.xz - drift.x * joint.zz) +
                     joint.xz * (drift.x * joint.yz - drift.y * joint.xz));
    F angular_impulse = d * (joint.xx * (joint.yy * rotation_rate - joint.yz * drift.y) +
                             joint.xy * (joint.yz * drift.x - joint.xy * rotation_rate) +
                             joint.xz * (joint.xy * drift.y - joint.yy * drift.x));
    const F sum = joint.limit_impulse + angular_impulse;
    const auto releases = joint.limit_side * sum < joint.limit_floor;
    if (any(releases)) {
      // A limit can only push. Its accumulated impulse becomes zero, and the point constraint is
      // solved again without it. For a joint that is not at a limit, this is what the other branch
      // computes, to the last bit: its limit impulse is +0, and its `xz` and `yz` are -0.
      const Vec<F> point_only =
          solve_point(joint, joint.limit_impulse * Vec<F>{joint.xz, joint.yz} - drift);
      impulse = select(releases, point_only, impulse);
      angular_impulse = pick(releases, -joint.limit_impulse, angular_impulse);
      joint.limit_impulse = pick(releases, F{}, sum);
    } else {
      joint.limit_impulse = sum;
    }
    joint.impulse += impulse;
    a.angular -= ia * (cross(joint.hull_arm, impulse) + angular_impulse);
    b.angular += ib * (cross(joint.leg_arm, impulse) + angular_impulse);
  }
  a.linear -= ma * impulse;
  b.linear += mb * impulse;
  velocities[kHull] = a;
  velocities[leg] = b;
  return impulse;
}

template <typename F>
[[gnu::always_inline]] inline Vec<F> solve_velocity_constraint(BasicJointConstraint<F>& joint,
                                                               BasicVelocities<F>& velocities) {
  return solve_velocity_constraint(joint, velocities, joint.leg);
}

}  // namespace touchdown::engine
