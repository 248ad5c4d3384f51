#include "engine/time_of_impact.hpp"

#include <optional>

#include "tests/check.hpp"
#include "tests/engine/shapes_for_tests.hpp"

namespace {

using namespace touchdown::engine;

// The search stops where the separation is kLinearSlop = 0.005, to within a quarter of that.
constexpr float kTolerance = 0.25f * kLinearSlop;

std::optional<float> impact_of(const Sweep& sweep) {
  return time_of_impact(ground(), unit_square(), sweep);
}

Sweep falling(float from, float to) {
  return {.start_center = {5.0f, from},
          .center = {5.0f, to},
          .start_angle = 0.0f,
          .angle = 0.0f,
          .start_time = 0.0f};
}

TEST("a square that falls onto the ground meets it on the way") {
  const auto time = impact_of(falling(2.5f, 0.5f));  // its lower side: from 2 m to 0 m
  CHECK(time.has_value());
  CHECK_NEAR(*time, (2.0 - 0.005) / 2.0, kTolerance / 2.0);
}

TEST("a square that would be below the ground at the end of the step is caught") {
  const auto time = impact_of(falling(10.5f, -9.5f));  // its lower side: from 10 m to -10 m
  CHECK(time.has_value());
  CHECK_NEAR(*time, (10.0 - 0.005) / 20.0, kTolerance / 20.0);
}

TEST("a square that stays above the ground has no time of impact") {
  CHECK(!impact_of(falling(2.5f, 0.6f)).has_value());
}

TEST("a square that is in the ground from the start has none either") {
  CHECK(!impact_of(falling(0.3f, -1.0f)).has_value());
}

TEST("a square turns its corner into the ground") {
  // Its centre stays at 0.6 m; a corner reaches 0.005 m where √½·sin(45° + θ) = 0.595: θ = 12.3°.
  Sweep sweep = falling(0.6f, 0.6f);
  sweep.angle = kPi / 4.0f;
  const auto time = impact_of(sweep);
  CHECK(time.has_value());
  CHECK_NEAR(*time, 12.3 / 45.0, 0.01);
}

TEST("whole turns before the step change nothing") {
  Sweep sweep = falling(2.5f, 0.5f);
  sweep.start_angle = sweep.angle = 8.0f * kPi;
  CHECK_NEAR(impact_of(sweep).value_or(-1.0f), (2.0 - 0.005) / 2.0, 1e-3);
}

TEST("a sweep is advanced along a straight line") {
  Sweep sweep = falling(4.0f, 0.0f);
  sweep.angle = 2.0f;
  advance_start(sweep, 0.25f);
  CHECK_EQUAL(sweep.start_center.y, 3.0f);
  CHECK_EQUAL(sweep.start_angle, 0.5f);
  CHECK_EQUAL(sweep.start_time, 0.25f);
  advance_start(sweep, 0.5f);  // a third of what is left
  CHECK_NEAR(sweep.start_center.y, 2.0, 1e-6);
  CHECK_EQUAL(sweep.center.y, 0.0f);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
