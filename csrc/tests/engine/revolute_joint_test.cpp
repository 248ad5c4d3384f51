#include "engine/revolute_joint.hpp"

#include <cmath>

#include "engine/joint_velocity_solver.hpp"
#include "tests/check.hpp"

namespace {

using namespace touchdown::engine;

constexpr int kJoint = 0;  // of leg 0, whose angle may be from 0.4 to 0.9 beyond its reference

const JointDefinition& definition() { return kJointDefinitions[kJoint]; }

// The hull upright, and the leg at an angle to it with the anchors `gap` metres apart.
Poses poses_at(float angle, float gap = 0.0f) {
  Poses poses{};
  poses[kHull] = pose_at({10.0f, 10.0f}, 0.0f, rotation(0.0f));
  const float leg_angle = definition().reference_angle + angle;
  const Rotation q = rotation(leg_angle);
  const Vec2 anchor = poses[kHull].center + definition().hull_anchor;
  poses[kLeg0] =
      pose_at(anchor - rotate(q, definition().leg_anchor) + Vec2{gap, 0.0f}, leg_angle, q);
  return poses;
}

Vec2 anchor_velocity(const Velocity& body, Vec2 arm) {
  return body.linear + cross(body.angular, arm);
}

TEST("between the limits the motor turns the leg and the anchors stay together") {
  Joint joint{};
  Poses poses = poses_at(0.6f);
  Velocities velocities{};
  velocities[kLeg0].linear = {1.0f, -2.0f};
  JointConstraint constraint = prepare(joint, definition(), poses, velocities);
  CHECK(!constraint.at_limit);
  for (int i = 0; i < kVelocityIterations; ++i) solve_velocity_constraint(constraint, velocities);
  const Vec2 drift = anchor_velocity(velocities[kLeg0], constraint.leg_arm) -
                     anchor_velocity(velocities[kHull], constraint.hull_arm);
  CHECK_NEAR(length(drift), 0.0, 1e-4);
  CHECK(std::fabs(constraint.motor_impulse) <= kMaxMotorImpulse);
}

TEST("the motor's impulse is at most its torque times the step") {
  Joint joint{};
  Poses poses = poses_at(0.6f);
  Velocities velocities{};
  velocities[kLeg0].angular = 1000.0f;
  JointConstraint constraint = prepare(joint, definition(), poses, velocities);
  solve_velocity_constraint(constraint, velocities);
  CHECK_NEAR(constraint.motor_impulse, -40.0 * 0.02, 1e-6);
}

TEST("a leg beyond its lower limit is stopped, and the limit only pushes") {
  Joint joint{};
  Poses poses = poses_at(0.3f);
  Velocities velocities{};
  velocities[kLeg0].angular = -5.0f;
  JointConstraint constraint = prepare(joint, definition(), poses, velocities);
  CHECK(joint.limit == LimitState::kLower);
  for (int i = 0; i < kVelocityIterations; ++i) solve_velocity_constraint(constraint, velocities);
  CHECK(constraint.limit_impulse >= 0.0f);
  CHECK(velocities[kLeg0].angular - velocities[kHull].angular > -1e-3f);
}

TEST("a leg that turns back from its limit is not held") {
  Joint joint{};
  Poses poses = poses_at(0.3f);
  Velocities velocities{};
  const Vec2 arm = rotate(rotation(poses[kLeg0]), definition().leg_anchor);
  velocities[kLeg0] = {-cross(50.0f, arm), 50.0f};  // about the anchor
  JointConstraint constraint = prepare(joint, definition(), poses, velocities);
  solve_velocity_constraint(constraint, velocities);
  CHECK_EQUAL(constraint.limit_impulse, 0.0f);
}

TEST("warm starting applies last step's impulses with equal and opposite momentum") {
  Joint joint{};
  joint.impulse = {2.0f, -3.0f};
  Poses poses = poses_at(0.6f);
  Velocities velocities{};
  prepare(joint, definition(), poses, velocities);
  const float hull_mass = 1.0f / kShapes[kHull].inverse_mass;
  const float leg_mass = 1.0f / kShapes[kLeg0].inverse_mass;
  CHECK_NEAR(leg_mass * velocities[kLeg0].linear.x, 2.0, 1e-5);
  CHECK_NEAR(hull_mass * velocities[kHull].linear.y, 3.0, 1e-5);
}

TEST("a limit's impulse is dropped once the joint has left the limit") {
  Joint joint{};
  joint.limit = LimitState::kLower;
  joint.limit_impulse = 7.0f;
  Poses poses = poses_at(0.6f);
  Velocities velocities{};
  prepare(joint, definition(), poses, velocities);
  CHECK_EQUAL(joint.limit_impulse, 0.0f);
}

TEST("position iterations bring the anchors together and keep the centre of mass") {
  Joint joint{};
  Poses poses = poses_at(0.6f, 0.1f);
  Velocities velocities{};
  const JointConstraint constraint = prepare(joint, definition(), poses, velocities);
  const float hull_mass = 1.0f / kShapes[kHull].inverse_mass;
  const float leg_mass = 1.0f / kShapes[kLeg0].inverse_mass;
  const float before = hull_mass * poses[kHull].center.x + leg_mass * poses[kLeg0].center.x;
  bool solved = false;
  for (int i = 0; i < 5 && !solved; ++i) {
    solved = solve_position_constraint(constraint, definition(), poses);
  }
  CHECK(solved);
  CHECK_NEAR(hull_mass * poses[kHull].center.x + leg_mass * poses[kLeg0].center.x, before, 1e-4);
}

TEST("position iterations turn a leg back to within the slop of its limit") {
  Joint joint{};
  Poses poses = poses_at(0.2f);
  Velocities velocities{};
  const JointConstraint constraint = prepare(joint, definition(), poses, velocities);
  for (int i = 0; i < 1000; ++i) solve_position_constraint(constraint, definition(), poses);
  const float angle = poses[kLeg0].angle - poses[kHull].angle - definition().reference_angle;
  CHECK_NEAR(angle, definition().lower_angle - kAngularSlop, 1e-3);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
