#include "engine/lander.hpp"

#include <cmath>
#include <limits>

#include "tests/check.hpp"
#include "tests/engine/flying.hpp"

namespace {

using namespace touchdown::engine;

TEST("discrete actions are stock's: nothing, left, main, right") {
  CHECK_EQUAL(discrete_throttle(0).main + discrete_throttle(0).side, 0.0);
  CHECK_EQUAL(discrete_throttle(1).side * discrete_throttle(1).direction, -1.0);
  CHECK_EQUAL(discrete_throttle(2).main, 1.0);
  CHECK_EQUAL(discrete_throttle(3).side * discrete_throttle(3).direction, 1.0);
}

TEST("a continuous main engine fires at half power or more") {
  CHECK_EQUAL(continuous_throttle(-0.5f, 0.0f).main, 0.0);
  CHECK_EQUAL(continuous_throttle(0.5f, 0.0f).main, 0.75);
  CHECK_EQUAL(continuous_throttle(9.0f, 0.0f).main, 1.0);  // clipped
}

TEST("continuous side engines do not fire below a half") {
  CHECK_EQUAL(continuous_throttle(0.0f, 0.5f).side, 0.0);
  CHECK_EQUAL(continuous_throttle(0.0f, -0.75f).side, 0.75);
  CHECK_EQUAL(continuous_throttle(0.0f, -0.75f).direction, -1.0);
}

TEST("the helipad is flat and lies between the flags") {
  Lander lander = seeded_lander(3);
  begin_alone(lander);
  for (int i = kMiddle - 1; i <= kMiddle + 1; ++i) {
    CHECK_NEAR(lander.world.terrain.heights[static_cast<std::size_t>(i)], kHelipadHeight * 0.99,
               1e-9);  // stock's average multiplies by 0.33, not by a third
  }
}

TEST("an episode begins above the helipad with its legs off the ground") {
  Lander lander = seeded_lander(3);
  const Transition first = begin_alone(lander);
  CHECK(std::fabs(first.observation[0]) < 0.05f);
  CHECK_NEAR(first.observation[1], 1.41, 0.05);
  CHECK_EQUAL(first.observation[6], 0.0f);
  CHECK_EQUAL(first.observation[7], 0.0f);
  CHECK(!first.terminated);
}

TEST("gravity adds 0.2 m/s to the fall in each step") {
  Lander lander = seeded_lander(3);
  begin_alone(lander);
  const float before = step_alone(lander, {}).observation[3];
  const float after = step_alone(lander, {}).observation[3];
  // stock scales the velocity by 6.67 m / 50: 0.2 · 6.67 / 50
  CHECK_NEAR(after - before, -0.2 * (400.0 / 30.0 / 2.0) / 50.0, 1e-3);
}

TEST("fuel costs 0.3 per step of the main engine and 0.03 per step of a side engine") {
  Lander lander = seeded_lander(3);
  begin_alone(lander);
  step_alone(lander, discrete_throttle(2));
  step_alone(lander, discrete_throttle(2));
  step_alone(lander, discrete_throttle(1));
  CHECK_NEAR(lander.fuel, 0.63, 1e-9);
}

TEST("free fall ends in a crash that costs 100") {
  Lander lander = seeded_lander(3);
  begin_alone(lander);
  Transition last{};
  for (int i = 0; i < 500 && !last.terminated; ++i) last = step_alone(lander, {});
  CHECK(last.terminated);
  CHECK_EQUAL(last.reward, -100.0);
}

TEST("a seed repeats, and two seeds differ") {
  Lander one = seeded_lander(3), same = seeded_lander(3), other = seeded_lander(4);
  const Observation first = begin_alone(one).observation;
  CHECK(first == begin_alone(same).observation);
  CHECK(!(first == begin_alone(other).observation));
}

}  // namespace

int main() { return touchdown::check::run_all(); }
