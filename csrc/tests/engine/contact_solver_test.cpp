#include "engine/contact_solver.hpp"

#include <cmath>

#include "engine/contact_velocity_solver.hpp"
#include "engine/lanes.hpp"
#include "tests/check.hpp"

namespace {

using namespace touchdown::engine;

// A body of 2 kg and 0.5 kg m² that touches the ground below its centre, at x and at -x, y = -1.
template <typename F>
BasicContactConstraint<F> contact_at(float x, int num_points) {
  BasicContactConstraint<F> contact{};
  contact.body = kHull;
  contact.num_points = num_points;
  contact.inverse_mass = broadcast<F>(0.5f);
  contact.inverse_inertia = broadcast<F>(2.0f);
  contact.friction = broadcast<F>(0.1f);
  contact.normal = {broadcast<F>(0.0f), broadcast<F>(1.0f)};
  contact.tangent = {broadcast<F>(1.0f), broadcast<F>(0.0f)};
  const float k = 0.5f + 2.0f * x * x;    // of one point's normal
  const float k12 = 0.5f - 2.0f * x * x;  // between the points
  for (int i = 0; i < 2; ++i) {
    auto& point = contact.points[static_cast<std::size_t>(i)];
    point.arm = {broadcast<F>(i == 0 ? x : -x), broadcast<F>(-1.0f)};
    point.normal_mass = broadcast<F>(1.0f / k);
    point.tangent_mass = broadcast<F>(1.0f / (0.5f + 2.0f));
  }
  contact.k11 = contact.k22 = broadcast<F>(k);
  contact.k12 = broadcast<F>(k12);
  const float determinant = k * k - k12 * k12;
  contact.m11 = contact.m22 = broadcast<F>(k / determinant);
  contact.m12 = broadcast<F>(-k12 / determinant);
  return contact;
}

Velocities moving(float vx, float vy, float angular) {
  Velocities velocities{};
  velocities[kHull] = {{vx, vy}, angular};
  return velocities;
}

TEST("one point below the centre stops a fall with an impulse of mass times speed") {
  auto contact = contact_at<float>(0.0f, 1);
  Velocities velocities = moving(0.0f, -3.0f, 0.0f);
  solve_velocity_constraint(contact, velocities);
  CHECK_EQUAL(velocities[kHull].linear.y, 0.0f);
  CHECK_EQUAL(velocities[kHull].angular, 0.0f);
  CHECK_EQUAL(contact.points[0].normal_impulse, 6.0f);
}

TEST("a contact never pulls") {
  auto contact = contact_at<float>(0.0f, 1);
  Velocities velocities = moving(0.0f, 3.0f, 0.0f);
  solve_velocity_constraint(contact, velocities);
  CHECK_EQUAL(velocities[kHull].linear.y, 3.0f);
  CHECK_EQUAL(contact.points[0].normal_impulse, 0.0f);
}

TEST("friction is bounded by the normal impulse") {
  auto contact = contact_at<float>(0.0f, 1);
  contact.points[0].normal_impulse = 6.0f;  // so at most 0.6 N s
  Velocities velocities = moving(100.0f, 0.0f, 0.0f);
  solve_velocity_constraint(contact, velocities);
  CHECK_NEAR(contact.points[0].tangent_impulse, -0.6, 1e-6);
  CHECK_NEAR(velocities[kHull].linear.x, 100.0 - 0.5 * 0.6, 1e-4);
}

TEST("friction stops a slow slide altogether") {
  auto contact = contact_at<float>(0.0f, 1);
  contact.points[0].normal_impulse = 6.0f;
  Velocities velocities = moving(0.25f, 0.0f, 0.0f);
  solve_velocity_constraint(contact, velocities);
  // the point's velocity: v + ω, with the arm of 1 m
  CHECK_NEAR(velocities[kHull].linear.x + velocities[kHull].angular, 0.0, 1e-6);
  CHECK_NEAR(contact.points[0].tangent_impulse, -0.25 / 2.5, 1e-6);
}

TEST("two points share an even fall") {
  auto contact = contact_at<float>(1.0f, 2);
  Velocities velocities = moving(0.0f, -3.0f, 0.0f);
  solve_velocity_constraint(contact, velocities);
  CHECK_NEAR(contact.points[0].normal_impulse, 3.0, 1e-6);
  CHECK_NEAR(contact.points[1].normal_impulse, 3.0, 1e-6);
  CHECK_NEAR(velocities[kHull].linear.y, 0.0, 1e-6);
  CHECK_EQUAL(contact.cases_seen, kBothPush);
}

TEST("of two points only the one that approaches pushes") {
  auto contact = contact_at<float>(1.0f, 2);
  Velocities velocities = moving(0.0f, 0.0f, -3.0f);  // the point at x = 1 goes down, the other up
  solve_velocity_constraint(contact, velocities);
  CHECK_NEAR(contact.points[0].normal_impulse, 3.0 / 2.5, 1e-6);
  CHECK_EQUAL(contact.points[1].normal_impulse, 0.0f);
  CHECK_EQUAL(contact.cases_seen, kFirstPushes);
}

TEST("two points that both recede do not push") {
  auto contact = contact_at<float>(1.0f, 2);
  Velocities velocities = moving(0.0f, 1.0f, 0.0f);
  solve_velocity_constraint(contact, velocities);
  CHECK_EQUAL(velocities[kHull].linear.y, 1.0f);
  CHECK_EQUAL(contact.cases_seen, kNeitherPushes);
}

TEST("lanes that meet different cases each get what they would get alone") {
  using F = Floats<4>;
  const float vy[4] = {-3.0f, 0.0f, 1.0f, -0.5f}, angular[4] = {0.0f, -3.0f, 0.0f, 2.0f};
  auto lanes = contact_at<F>(1.0f, 2);
  BasicVelocities<F> lane_velocities{};
  for (int lane = 0; lane < 4; ++lane) {
    lane_velocities[kHull].linear.y[lane] = vy[lane];
    lane_velocities[kHull].angular[lane] = angular[lane];
  }
  solve_velocity_constraint(lanes, lane_velocities);
  for (int lane = 0; lane < 4; ++lane) {
    auto alone = contact_at<float>(1.0f, 2);
    Velocities velocities = moving(0.0f, vy[lane], angular[lane]);
    solve_velocity_constraint(alone, velocities);
    CHECK_EQUAL(lane_velocities[kHull].linear.y[lane], velocities[kHull].linear.y);
    CHECK_EQUAL(lane_velocities[kHull].angular[lane], velocities[kHull].angular);
    CHECK_EQUAL(lanes.points[0].normal_impulse[lane], alone.points[0].normal_impulse);
    CHECK_EQUAL(lanes.points[1].normal_impulse[lane], alone.points[1].normal_impulse);
    CHECK_EQUAL(lanes.cases_seen[lane], alone.cases_seen);
  }
}

TEST("a position iteration pushes a body out of the ground by a share of the overlap") {
  ContactPositionConstraint constraint{};
  constraint.body = kHull;
  constraint.num_points = 1;
  constraint.face = Face::kEdge;
  constraint.inverse_mass = 0.5f;
  constraint.local_normal = {0.0f, 1.0f};
  constraint.local_points[0] = {0.0f, -1.0f};
  Poses poses{};
  const float overlap = 0.1f;
  poses[kHull] = pose_at({5.0f, 1.0f + 2.0f * kPolygonRadius - overlap}, 0.0f, rotation(0.0f));
  const float separation = solve_position_constraint(constraint, poses, kBaumgarte);
  CHECK_NEAR(separation, -overlap, 1e-6);
  // a fifth of the overlap beyond the slop of 0.005
  CHECK_NEAR(poses[kHull].center.y, 1.02 - 0.1 + 0.2 * 0.095, 1e-6);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
