// What the velocity iterations read and change: one row a joint and one a contact.
//
// The method is sequential impulses (E. Catto, "Iterative Dynamics with Temporal Coherence", 2005):
// each row cancels its own error in turn, again and again, and remembers the sum of its impulses.
//
// Everything here is written for `F`, a float or as many floats as there are lanes: one environment
// and many are solved by the same lines. A lane that goes another way than its neighbours is
// selected, never masked by adding a zero, because a zero has a sign.
#pragma once

#include <array>
#include <cstddef>
#include <type_traits>

#include "lanes.hpp"
#include "layout.hpp"
#include "math.hpp"

namespace touchdown {

inline constexpr float kMaxMotorImpulse = kTimeStep * 40.0f;  // of a torque of 40 N m

// The same number in every lane.
template <typename F>
constexpr F broadcast(float value) {
  if constexpr (std::is_same_v<F, float>) {
    return value;
  } else {
    return F{} + value;
  }
}

template <typename Mask, typename F>
constexpr Vec<F> select(Mask condition, Vec<F> a, Vec<F> b) {
  return {condition ? a.x : b.x, condition ? a.y : b.y};
}

// A whole number for each lane, as wide as a comparison's result.
template <typename F>
using Whole = std::conditional_t<std::is_same_v<F, float>, int, decltype(F{} < F{})>;

template <typename F>
struct BasicVelocity {
  Vec<F> linear;
  F angular;
};

template <typename F>
using BasicVelocities = std::array<BasicVelocity<F>, kNumBodies>;

// The hinge between the hull and a leg: constants of the step, then the sums that iterations change.
template <typename F>
struct BasicJointRow {
  F hull_inverse_mass, leg_inverse_mass;
  F hull_inverse_inertia, leg_inverse_inertia;
  Vec<F> hull_arm, leg_arm;  // from the centres of mass to the hinge
  // The symmetric matrix that takes impulses (x, y, turn) to changes of relative velocity.
  F xx, xy, yy, xz, yz, zz;
  F yz_cross_x, yz_cross_y, yz_cross_z;  // the cross product of its second and third columns
  F inverse_determinant_2;               // of the upper two rows and columns
  F minus_inverse_determinant_3;
  F motor_mass;
  F motor_speed;
  F stop_side;  // at a stop: 1 at the lower one, -1 at the upper

  Vec<F> impulse;
  F limit_impulse;
  F motor_impulse;

  // The same in every lane.
  int leg;
  bool at_stop;
};

template <typename F>
struct BasicContactPointRow {
  Vec<F> arm;  // from the body's centre of mass
  F normal_mass;
  F tangent_mass;
  F normal_impulse;
  F tangent_impulse;
};

template <typename F>
struct BasicContactRow {
  F inverse_mass;
  F inverse_inertia;
  F friction;
  Vec<F> normal;  // from the moon to the body
  Vec<F> tangent;
  std::array<BasicContactPointRow<F>, 2> points;
  // For two points: the symmetric matrix from normal impulses to normal velocities, and back.
  F k11, k12, k22;
  F m11, m12, m22;

  Whole<F> cases_seen;  // how the two-point solver left its iterations

  // The same in every lane.
  int body;
  int num_points;
};

// Bits of a row's `cases_seen`.
inline constexpr int kBothPush = 1;
inline constexpr int kFirstPushes = 2;
inline constexpr int kSecondPushes = 4;
inline constexpr int kNeitherPushes = 8;
inline constexpr int kNoSolution = 16;
inline constexpr int kNumBlockCases = 5;

template <typename F>
struct BasicVelocityRows {
  BasicVelocities<F> velocities;
  std::array<BasicJointRow<F>, kNumLegs> joints;
  std::array<BasicContactRow<F>, kMaxContacts> contacts;
  int num_contacts;
};

// Rows begin with what differs from lane to lane: so many floats of each.
inline constexpr std::size_t kVelocityFloats = sizeof(BasicVelocities<float>) / sizeof(float);
inline constexpr std::size_t kJointFloats =
    offsetof(BasicJointRow<float>, leg) / sizeof(float);
inline constexpr std::size_t kContactFloats =
    offsetof(BasicContactRow<float>, cases_seen) / sizeof(float);

// Negations are taken into what follows them where that changes no bit: a + -b is a - b, and -a * b
// is -(a * b). But -(a - b) is not b - a, for where a equals b their zeros differ.

// The impulse that gives the hinge's points this relative velocity, whatever the turning.
template <typename F>
constexpr Vec<F> solve_point(const BasicJointRow<F>& row, Vec<F> v) {
  return {row.inverse_determinant_2 * (row.yy * v.x - row.xy * v.y),
          row.inverse_determinant_2 * (row.xx * v.y - row.xy * v.x)};
}

// Gives the impulse on the hinge's point, which nothing reads again within the step.
template <typename F>
[[gnu::always_inline]] inline Vec<F> iterate_velocity(BasicJointRow<F>& row,
                                                      BasicVelocities<F>& velocities) {
  BasicVelocity<F> a = velocities[kHull];
  BasicVelocity<F> b = velocities[row.leg];
  const F ma = row.hull_inverse_mass;
  const F mb = row.leg_inverse_mass;
  const F ia = row.hull_inverse_inertia;
  const F ib = row.leg_inverse_inertia;

  {
    const F most = broadcast<F>(kMaxMotorImpulse);
    const F error = b.angular - a.angular - row.motor_speed;
    const F before = row.motor_impulse;
    row.motor_impulse = clamp(before - row.motor_mass * error, -most, most);
    const F impulse = row.motor_impulse - before;
    a.angular -= ia * impulse;
    b.angular += ib * impulse;
  }

  const Vec<F> slip{
      b.linear.x - b.angular * row.leg_arm.y - a.linear.x + a.angular * row.hull_arm.y,
      b.linear.y + b.angular * row.leg_arm.x - a.linear.y - a.angular * row.hull_arm.x};
  Vec<F> impulse;
  if (!row.at_stop) {
    // What `solve_point` gives for -slip.
    impulse = {row.inverse_determinant_2 * (row.xy * slip.y - row.yy * slip.x),
               row.inverse_determinant_2 * (row.xy * slip.x - row.xx * slip.y)};
    row.impulse += impulse;
    a.angular -= ia * cross(row.hull_arm, impulse);
    b.angular += ib * cross(row.leg_arm, impulse);
  } else {
    // Cramer's rule.
    const F spin = b.angular - a.angular;
    const F d = row.minus_inverse_determinant_3;
    impulse.x = d * (slip.x * row.yz_cross_x + slip.y * row.yz_cross_y + spin * row.yz_cross_z);
    impulse.y = d * (row.xx * (slip.y * row.zz - spin * row.yz) +
                     row.xy * (spin * row.xz - slip.x * row.zz) +
                     row.xz * (slip.x * row.yz - slip.y * row.xz));
    F turn = d * (row.xx * (row.yy * spin - row.yz * slip.y) +
                  row.xy * (row.yz * slip.x - row.xy * spin) +
                  row.xz * (row.xy * slip.y - row.yy * slip.x));
    const F sum = row.limit_impulse + turn;
    const auto pulls = row.stop_side * sum < 0.0f;
    if (any(pulls)) {
      // A stop can only push: it lets go, and the hinge makes up for what it no longer gives.
      const Vec<F> alone = solve_point(row, row.limit_impulse * Vec<F>{row.xz, row.yz} - slip);
      impulse = select(pulls, alone, impulse);
      turn = pulls ? -row.limit_impulse : turn;
      row.limit_impulse = pulls ? F{} : sum;
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
  return impulse;
}

template <typename F>
constexpr Vec<F> velocity_at(const BasicContactPointRow<F>& point, const BasicVelocity<F>& body) {
  return body.linear + cross(body.angular, point.arm);
}

// Both normal impulses at once: the linear complementarity problem of two points, by trying its
// four cases (K. Murty's total enumeration), each of which a velocity or an impulse of zero ends.
template <typename F>
inline void iterate_two_points(BasicContactRow<F>& row, BasicVelocity<F>& body) {
  BasicContactPointRow<F>& first = row.points[0];
  BasicContactPointRow<F>& second = row.points[1];
  const Vec<F> before{first.normal_impulse, second.normal_impulse};
  // What the normal velocities would be without any impulse of these two.
  const Vec<F> free =
      Vec<F>{dot(velocity_at(first, body), row.normal),
             dot(velocity_at(second, body), row.normal)} -
      Vec<F>{row.k11 * before.x + row.k12 * before.y, row.k12 * before.x + row.k22 * before.y};

  Vec<F> after = -Vec<F>{row.m11 * free.x + row.m12 * free.y, row.m12 * free.x + row.m22 * free.y};
  const auto both = after.x >= 0.0f && after.y >= 0.0f;
  auto solved = both;
  if (all(both)) {
    row.cases_seen |= kBothPush;
  } else {
    const F zero{};
    const Vec<F> alone{-first.normal_mass * free.x, -second.normal_mass * free.y};
    const auto only_first = alone.x >= 0.0f && row.k12 * alone.x + free.y >= 0.0f;
    const auto only_second = alone.y >= 0.0f && row.k12 * alone.y + free.x >= 0.0f;
    const auto neither = free.x >= 0.0f && free.y >= 0.0f;
    after.x = both ? after.x : only_first ? alone.x : zero;
    after.y = both ? after.y : only_first ? zero : only_second ? alone.y : zero;
    // Rounding may leave no case: the impulses stay, and the next iteration tries again.
    solved = both || only_first || only_second || neither;
    const auto bit = [](int block_case) { return Whole<F>{} + block_case; };
    row.cases_seen |= both          ? bit(kBothPush)
                      : only_first  ? bit(kFirstPushes)
                      : only_second ? bit(kSecondPushes)
                      : neither     ? bit(kNeitherPushes)
                                    : bit(kNoSolution);
  }

  const Vec<F> change = after - before;
  const Vec<F> p1 = change.x * row.normal;
  const Vec<F> p2 = change.y * row.normal;
  const Vec<F> linear = body.linear + row.inverse_mass * (p1 + p2);
  const F angular =
      body.angular + row.inverse_inertia * (cross(first.arm, p1) + cross(second.arm, p2));
  if (all(solved)) {
    body = {linear, angular};
    first.normal_impulse = after.x;
    second.normal_impulse = after.y;
  } else {
    body = {select(solved, linear, body.linear), solved ? angular : body.angular};
    first.normal_impulse = solved ? after.x : before.x;
    second.normal_impulse = solved ? after.y : before.y;
  }
}

template <typename F>
[[gnu::always_inline]] inline void iterate_velocity(BasicContactRow<F>& row, BasicVelocities<F>& velocities) {
  BasicVelocity<F> body = velocities[row.body];
  // Friction first, bounded by the last normal impulse: that nothing sinks in matters more.
  for (int i = 0; i < row.num_points; ++i) {
    BasicContactPointRow<F>& point = row.points[i];
    const F slip = dot(velocity_at(point, body), row.tangent);
    const F bound = row.friction * point.normal_impulse;
    const F before = point.tangent_impulse;
    point.tangent_impulse = clamp(before - point.tangent_mass * slip, -bound, bound);
    const Vec<F> p = (point.tangent_impulse - before) * row.tangent;
    body.linear += row.inverse_mass * p;
    body.angular += row.inverse_inertia * cross(point.arm, p);
  }
  if (row.num_points == 1) {
    BasicContactPointRow<F>& point = row.points[0];
    const F approach = dot(velocity_at(point, body), row.normal);
    const F before = point.normal_impulse;
    point.normal_impulse = larger(before - point.normal_mass * approach, F{});
    const Vec<F> p = (point.normal_impulse - before) * row.normal;
    body.linear += row.inverse_mass * p;
    body.angular += row.inverse_inertia * cross(point.arm, p);
  } else {
    iterate_two_points(row, body);
  }
  velocities[row.body] = body;
}

}  // namespace touchdown
