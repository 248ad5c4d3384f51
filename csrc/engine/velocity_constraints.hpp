// The constraints that the velocity iterations solve: two revolute joints and some contacts.
//
// Box2D: the data of b2RevoluteJoint (m_mass, m_impulse, ...), b2ContactVelocityConstraint and
// b2Velocity. The method is sequential impulses (E. Catto, "Iterative Dynamics with Temporal
// Coherence", 2005): each constraint removes its own velocity error in turn, many times over, and
// accumulates its impulses.
//
// Everything is a template over `F`: a float, or a vector of floats with one environment per lane.
// One environment and many are solved by the same lines.
#pragma once

#include <array>
#include <cstddef>

#include "engine/lanes.hpp"
#include "engine/math.hpp"
#include "engine/settings.hpp"

namespace touchdown::engine {

template <typename F>
struct BasicVelocity {
  Vec<F> linear;
  F angular;
};

template <typename F>
using BasicVelocities = std::array<BasicVelocity<F>, kNumBodies>;

// The revolute joint between the hull and a leg: constants of the step, then the accumulated
// impulses.
template <typename F>
struct BasicJointConstraint {
  F hull_inverse_mass, leg_inverse_mass;
  F hull_inverse_inertia, leg_inverse_inertia;
  Vec<F> hull_arm, leg_arm;  // from the centres of mass to the anchor
  // The symmetric 3 × 3 matrix K: impulse (x, y, angular) to change of relative velocity.
  F xx, xy, yy, xz, yz, zz;
  F yz_cross_x, yz_cross_y, yz_cross_z;  // the cross product of its second and third columns
  F inverse_determinant_2;               // of the upper left 2 × 2 block
  F minus_inverse_determinant_3;
  F motor_mass;
  F motor_speed;
  F limit_side;  // 1 at the lower limit, -1 at the upper
  // The limit lets go where its impulse, seen from its side, is below this: zero, or infinity for a
  // joint that is not at a limit, but shares its vector with some that are.
  F limit_floor;

  Vec<F> impulse;
  F limit_impulse;
  F motor_impulse;

  // The same in every lane.
  int leg;
  bool at_limit;  // in lanes: whether any of them is
};

// A point of a contact: its effective masses and its accumulated impulses.
template <typename F>
struct BasicContactPoint {
  Vec<F> arm;  // from the body's centre of mass
  F normal_mass;
  F tangent_mass;
  F normal_impulse;
  F tangent_impulse;
};

// A contact between the moon and one body, at one or two points.
template <typename F>
struct BasicContactConstraint {
  F inverse_mass;
  F inverse_inertia;
  F friction;
  Vec<F> normal;  // from the moon to the body
  Vec<F> tangent;
  std::array<BasicContactPoint<F>, 2> points;
  // For two points: the symmetric matrix K from normal impulses to normal velocities, and its
  // inverse.
  F k11, k12, k22;
  F m11, m12, m22;

  Whole<F> cases_seen;  // bits: which cases of the two-point solver this step has met

  // The same in every lane.
  int body;
  int num_points;
};

// Bits of a contact's `cases_seen`.
inline constexpr int kBothPush = 1;
inline constexpr int kFirstPushes = 2;
inline constexpr int kSecondPushes = 4;
inline constexpr int kNeitherPushes = 8;
inline constexpr int kNoSolution = 16;
inline constexpr int kNumBlockCases = 5;

// All that the velocity iterations of one step read and change.
template <typename F>
struct BasicVelocityConstraints {
  BasicVelocities<F> velocities;
  std::array<BasicJointConstraint<F>, kNumLegs> joints;
  std::array<BasicContactConstraint<F>, kMaxContacts> contacts;
  int num_contacts;
};

// The leading floats of each struct differ from lane to lane; what comes after them does not.
inline constexpr std::size_t kVelocityFloats = sizeof(BasicVelocities<float>) / sizeof(float);
inline constexpr std::size_t kJointFloats =
    offsetof(BasicJointConstraint<float>, leg) / sizeof(float);
// The last of them are not functions of the poses.
inline constexpr std::size_t kChangingFloats =
    kJointFloats - offsetof(BasicJointConstraint<float>, limit_side) / sizeof(float);
template <typename F>
F* changing_floats(BasicJointConstraint<F>& joint) {
  return &joint.limit_side;
}
inline constexpr std::size_t kContactFloats =
    offsetof(BasicContactConstraint<float>, cases_seen) / sizeof(float);

}  // namespace touchdown::engine
