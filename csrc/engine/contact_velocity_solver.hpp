// One velocity iteration of a contact, for one environment or for one environment per lane.
//
// Box2D: b2ContactSolver::SolveVelocityConstraints. The moon is static, so its half of every
// equation is left out. A lane that takes another branch than its neighbours is selected, never
// masked by adding a zero, because a zero has a sign.
#pragma once

#include "engine/lanes.hpp"
#include "engine/math.hpp"
#include "engine/velocity_constraints.hpp"

namespace touchdown::engine {

template <typename F>
constexpr Vec<F> velocity_at(const BasicContactPoint<F>& point, const BasicVelocity<F>& body) {
  return body.linear + cross(body.angular, point.arm);
}

// Both normal impulses at once (Box2D's block solver): the linear complementarity problem of two
// points, solved by trying its four cases in turn (K. Murty's total enumeration). In each case
// every point has either a normal impulse or a normal velocity of zero.
template <typename F>
inline void solve_two_points(BasicContactConstraint<F>& contact, BasicVelocity<F>& body) {
  BasicContactPoint<F>& first = contact.points[0];
  BasicContactPoint<F>& second = contact.points[1];
  const Vec<F> before{first.normal_impulse, second.normal_impulse};
  // The normal velocities if neither point had any accumulated impulse.
  const Vec<F> free = Vec<F>{dot(velocity_at(first, body), contact.normal),
                             dot(velocity_at(second, body), contact.normal)} -
                      Vec<F>{contact.k11 * before.x + contact.k12 * before.y,
                             contact.k12 * before.x + contact.k22 * before.y};

  Vec<F> after = -Vec<F>{contact.m11 * free.x + contact.m12 * free.y,
                         contact.m12 * free.x + contact.m22 * free.y};
  const auto both = after.x >= 0.0f && after.y >= 0.0f;
  auto solved = both;
  if (all(both)) {
    contact.cases_seen |= Whole<F>{} + kBothPush;
  } else {
    const F zero{};
    const Vec<F> single{-first.normal_mass * free.x, -second.normal_mass * free.y};
    const auto only_first = single.x >= 0.0f && contact.k12 * single.x + free.y >= 0.0f;
    const auto only_second = single.y >= 0.0f && contact.k12 * single.y + free.x >= 0.0f;
    const auto neither = free.x >= 0.0f && free.y >= 0.0f;
    after.x = pick(both, after.x, pick(only_first, single.x, zero));
    after.y = pick(both, after.y, pick(only_first, zero, pick(only_second, single.y, zero)));
    // Rounding may leave no valid case: the impulses stay, and the next iteration tries again.
    solved = both || only_first || only_second || neither;
    const auto bit = [](int block_case) { return Whole<F>{} + block_case; };
    contact.cases_seen |= pick(both, bit(kBothPush),
                               pick(only_first, bit(kFirstPushes),
                                    pick(only_second, bit(kSecondPushes),
                                         pick(neither, bit(kNeitherPushes), bit(kNoSolution)))));
  }

  const Vec<F> change = after - before;
  const Vec<F> p1 = change.x * contact.normal;
  const Vec<F> p2 = change.y * contact.normal;
  const Vec<F> linear = body.linear + contact.inverse_mass * (p1 + p2);
  const F angular =
      body.angular + contact.inverse_inertia * (cross(first.arm, p1) + cross(second.arm, p2));
  if (all(solved)) {
    body = {linear, angular};
    first.normal_impulse = after.x;
    second.normal_impulse = after.y;
  } else {
    body = {select(solved, linear, body.linear), pick(solved, angular, body.angular)};
    first.normal_impulse = pick(solved, after.x, before.x);
    second.normal_impulse = pick(solved, after.y, before.y);
  }
}

// One velocity iteration of a contact: friction, then the normal impulses.
template <typename F>
[[gnu::always_inline]] inline void solve_velocity_constraint(BasicContactConstraint<F>& contact,
                                                             BasicVelocities<F>& velocities) {
  BasicVelocity<F> body = velocities[contact.body];
  // Friction comes first, as non-penetration matters more and so has the last word. It is bounded
  // by the normal impulse of the iteration before.
  for (int i = 0; i < contact.num_points; ++i) {
    BasicContactPoint<F>& point = contact.points[i];
    const F slip = dot(velocity_at(point, body), contact.tangent);
    const F bound = contact.friction * point.normal_impulse;
    const F before = point.tangent_impulse;
    point.tangent_impulse = clamp(before - point.tangent_mass * slip, -bound, bound);
    const Vec<F> p = (point.tangent_impulse - before) * contact.tangent;
    body.linear += contact.inverse_mass * p;
    body.angular += contact.inverse_inertia * cross(point.arm, p);
  }
  if (contact.num_points == 1) {
    BasicContactPoint<F>& point = contact.points[0];
    const F approach = dot(velocity_at(point, body), contact.normal);
    const F before = point.normal_impulse;
    point.normal_impulse = larger(before - point.normal_mass * approach, F{});
    const Vec<F> p = (point.normal_impulse - before) * contact.normal;
    body.linear += contact.inverse_mass * p;
    body.angular += contact.inverse_inertia * cross(point.arm, p);
  } else {
    solve_two_points(contact, body);
  }
  velocities[contact.body] = body;
}

}  // namespace touchdown::engine
