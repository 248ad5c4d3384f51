#include "engine/time_of_impact.hpp"

#include <array>
#include <cstdint>
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

TEST("an edge that is out of reach is not hit by the sweep") {
  // Sloping edges, and sweeps at random near them; a bound that were too bold would miss impacts.
  Pcg64 rng = Pcg64::seeded(std::array<std::uint32_t, 1>{3});
  const auto draw = [&rng](double low, double high) {
    return static_cast<float>(rng.uniform(low, high));
  };
  int out_of_reach = 0, hits = 0, missed = 0;
  for (int i = 0; i < 20000; ++i) {
    const Edge edge = make_edge({4.0f, draw(0.0, 2.0)}, {6.0f, draw(0.0, 2.0)}, 0.1f);
    const Shape& shape = kShapes[static_cast<std::size_t>(i % kNumBodies)];
    const Vec2 start{draw(3.0, 7.0), draw(0.0, 3.0)};
    const float reach = draw(0.0, 0.4);
    Sweep sweep{.start_center = start,
                .center = start + Vec2{draw(-reach, reach), draw(-reach, reach)},
                .start_angle = draw(-3.0, 3.0)};
    sweep.angle = sweep.start_angle + draw(-reach, reach);
    const Transform end = transform_about(sweep.center, rotation(sweep.angle), shape.local_center);
    const bool hit = time_of_impact(edge, shape, sweep).has_value();
    const bool out = detail::is_out_of_reach(edge, shape, sweep, end);
    out_of_reach += out;
    hits += hit;
    missed += out && hit;
  }
  CHECK(out_of_reach > 5000);
  CHECK(hits > 500);
  CHECK_EQUAL(missed, 0);
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
