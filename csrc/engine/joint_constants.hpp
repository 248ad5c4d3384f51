// The constants of a joint's constraint, and its warm start, for one environment or for one
// environment per lane.
//
// Box2D: b2RevoluteJoint::InitVelocityConstraints.
#pragma once

#include "engine/joint_position_solver.hpp"
#include "engine/lanes.hpp"
#include "engine/math.hpp"
#include "engine/motion.hpp"
#include "engine/settings.hpp"
#include "engine/shape.hpp"
#include "engine/velocity_constraints.hpp"

namespace touchdown::engine {

// What depends on the shapes alone.
template <typename F>
inline void set_masses(BasicJointConstraint<F>& c, const Shape& hull, const Shape& leg) {
  c.hull_inverse_mass = broadcast<F>(hull.inverse_mass);
  c.leg_inverse_mass = broadcast<F>(leg.inverse_mass);
  c.hull_inverse_inertia = broadcast<F>(hull.inverse_inertia);
  c.leg_inverse_inertia = broadcast<F>(leg.inverse_inertia);
  c.zz = c.hull_inverse_inertia + c.leg_inverse_inertia;
  c.motor_mass = 1.0f / c.zz;
}

// What depends on the poses. The masses are set.
template <typename F>
inline void set_constants(BasicJointConstraint<F>& c, const JointDefinition& definition,
                          BasicPoses<F>& poses) {
  const F ma = c.hull_inverse_mass;
  const F mb = c.leg_inverse_mass;
  const F ia = c.hull_inverse_inertia;
  const F ib = c.leg_inverse_inertia;
  const Vec<F> ra = c.hull_arm =
      rotate(rotation(poses[kHull]), broadcast<F>(definition.hull_anchor));
  const Vec<F> rb = c.leg_arm =
      rotate(rotation(poses[definition.leg]), broadcast<F>(definition.leg_anchor));

  c.xx = ma + mb + ra.y * ra.y * ia + rb.y * rb.y * ib;
  c.xy = -ra.y * ra.x * ia - rb.y * rb.x * ib;
  c.xz = -ra.y * ia - rb.y * ib;
  c.yy = ma + mb + ra.x * ra.x * ia + rb.x * rb.x * ib;
  c.yz = ra.x * ia + rb.x * ib;
  c.motor_speed = broadcast<F>(definition.motor_speed);

  c.yz_cross_x = c.yy * c.zz - c.yz * c.yz;
  c.yz_cross_y = c.yz * c.xz - c.xy * c.zz;
  c.yz_cross_z = c.xy * c.yz - c.yy * c.xz;
  const F determinant_3 = c.xx * c.yz_cross_x + c.xy * c.yz_cross_y + c.xz * c.yz_cross_z;
  c.minus_inverse_determinant_3 = -pick(determinant_3 != 0.0f, 1.0f / determinant_3, determinant_3);
  const F determinant_2 = c.xx * c.yy - c.xy * c.xy;
  c.inverse_determinant_2 = pick(determinant_2 != 0.0f, 1.0f / determinant_2, determinant_2);

  // See the velocity solver.
  const auto at_limit = c.limit_floor == 0.0f;
  c.xz = pick(at_limit, c.xz, broadcast<F>(-0.0f));
  c.yz = pick(at_limit, c.yz, broadcast<F>(-0.0f));
}

// Applies last step's impulses.
template <typename F>
inline void warm_start(const BasicJointConstraint<F>& c, BasicVelocities<F>& velocities) {
  BasicVelocity<F>& a = velocities[kHull];
  BasicVelocity<F>& b = velocities[c.leg];
  const Vec<F> p = c.impulse;
  a.linear -= c.hull_inverse_mass * p;
  a.angular -= c.hull_inverse_inertia * (cross(c.hull_arm, p) + c.motor_impulse + c.limit_impulse);
  b.linear += c.leg_inverse_mass * p;
  b.angular += c.leg_inverse_inertia * (cross(c.leg_arm, p) + c.motor_impulse + c.limit_impulse);
}

}  // namespace touchdown::engine
