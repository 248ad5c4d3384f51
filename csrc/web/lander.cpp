// The engine as a browser sees it: landers that fly one by one, behind plain C functions.
//
// src/touchdown/web/static/engine/lander.js calls them, and checks all arguments before.
#include "engine/lander.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "engine/kernel.hpp"
#include "engine/snapshot.hpp"
#include "engine/terrain.hpp"
#include "web/export.hpp"

namespace touchdown::web {
namespace {

using engine::kNumBodies;
using engine::kNumHeights;
using engine::kObservationSize;

constexpr std::int32_t kTimeLimit = 1000;  // steps, as Gymnasium's

enum class Outcome : std::int32_t { kNone, kLanded, kCrashed, kOutOfBounds, kTimedOut };

// What an episode is so far. It stays as it is when the lander is stepped beyond the end.
struct Episode {
  double total;  // sum of rewards
  double fuel;   // return points
  std::int32_t steps;
  Outcome outcome;
};

// What lander.js reads after each call. It knows the offsets.
struct Report {
  double reward;
  Episode episode;
  std::array<double, kNumHeights> heights;
  std::array<float, kObservationSize> observation;
  std::array<float, std::size_t{3} * kNumBodies> bodies;  // x, y, angle of each
  std::int32_t terminated;
  std::int32_t truncated;
};
static_assert(offsetof(Report, episode) == 8 && offsetof(Report, heights) == 32);
static_assert(offsetof(Report, observation) == 120 && offsetof(Report, bodies) == 152);
static_assert(offsetof(Report, terminated) == 188 && offsetof(Report, truncated) == 192);

// A lander's state without what only a step needs: what a snapshot holds.
struct State {
  Episode episode;
  engine::Lander lander;
};

struct Flight {
  Report report;  // first: its address is the flight's
  State state;
  engine::Config next;  // settings from the next reset on
  engine::StepState step;
  engine::Coverage coverage;
};

// The kernel is the engine's, with one lane in use: the velocity iterations in flight end early
// where they cycle.
void solve(engine::StepState& step) {
  const engine::SolverKernel& kernel = engine::kernel();
  engine::VelocityConstraints* const one = &step.constraints;
  const std::span<engine::VelocityConstraints* const> items{&one, 1};
  if (!engine::may_cycle(step.constraints)) {
    kernel.solve(items, engine::model());
    return;
  }
  bool done = false;
  kernel.start(items, {&done, 1}, engine::model());
  if (!done) kernel.resume(items, engine::model());
}

void report_state(Flight& flight) {
  const engine::World& world = flight.state.lander.world;
  Report& report = flight.report;
  report.episode = flight.state.episode;
  report.heights = world.terrain.heights;
  for (std::size_t i = 0; i < kNumBodies; ++i) {
    const engine::Body& body = world.bodies[i];
    report.bodies[3 * i] = body.transform.origin.x;
    report.bodies[3 * i + 1] = body.transform.origin.y;
    report.bodies[3 * i + 2] = body.sweep.angle;
  }
}

engine::Transition finish(Flight& flight, bool solves) {
  engine::Lander& lander = flight.state.lander;
  if (solves) {
    solve(flight.step);
    engine::finish_solve(lander.world, flight.step, flight.coverage);
  }
  const engine::Transition transition = engine::end_step(lander, flight.coverage);
  flight.report.observation = transition.observation;
  return transition;
}

// By the rule of touchdown.envs.outcome.
Outcome outcome_of(const engine::Transition& transition, bool truncated) {
  if (!transition.terminated) return truncated ? Outcome::kTimedOut : Outcome::kNone;
  if (transition.reward == 100.0) return Outcome::kLanded;
  return std::fabs(transition.observation[0]) >= 1.0f ? Outcome::kOutOfBounds : Outcome::kCrashed;
}

engine::Config config_of(double gravity, bool wind, double wind_power, double turbulence_power) {
  return {.gravity = gravity,
          .wind_power = wind_power,
          .turbulence_power = turbulence_power,
          .enable_wind = wind};
}

}  // namespace

TOUCHDOWN_EXPORT(lander_new)
Flight* lander_new() { return new Flight{}; }

TOUCHDOWN_EXPORT(lander_free)
void lander_free(Flight* flight) { delete flight; }

TOUCHDOWN_EXPORT(lander_configure)
void lander_configure(Flight* flight, double gravity, bool wind, double wind_power,
                      double turbulence_power) {
  flight->next = config_of(gravity, wind, wind_power, turbulence_power);
}

// The seed is high · 2^32 + low.
TOUCHDOWN_EXPORT(lander_reset)
void lander_reset(Flight* flight, std::uint32_t low, std::uint32_t high) {
  const std::array<std::uint32_t, 2> words{low, high};
  State& state = flight->state;
  state = State{.episode = {}, .lander = engine::make_lander(flight->next)};
  engine::seed(state.lander, std::span(words).first(high == 0 ? 1 : 2));
  finish(*flight, engine::begin_episode(state.lander, flight->step, flight->coverage));
  flight->report.reward = 0.0;
  flight->report.terminated = flight->report.truncated = 0;
  report_state(*flight);
}

TOUCHDOWN_EXPORT(lander_step)
void lander_step(Flight* flight, std::int32_t action) {
  State& state = flight->state;
  const engine::Transition transition =
      finish(*flight, engine::begin_step(state.lander, engine::discrete_throttle(action),
                                         flight->step, flight->coverage));
  Episode& episode = state.episode;
  const bool over = episode.outcome != Outcome::kNone;
  const bool truncated = episode.steps + 1 >= kTimeLimit;
  if (!over) {
    ++episode.steps;
    episode.total += transition.reward;
    episode.fuel = state.lander.fuel;
    episode.outcome = outcome_of(transition, truncated);
  }
  flight->report.reward = transition.reward;
  flight->report.terminated = transition.terminated;
  flight->report.truncated = truncated;
  report_state(*flight);
}

TOUCHDOWN_EXPORT(snapshot_size)
std::size_t snapshot_size() { return sizeof(State); }

TOUCHDOWN_EXPORT(lander_snapshot)
void lander_snapshot(const Flight* flight, std::byte* bytes) {
  std::memcpy(bytes, &flight->state, sizeof(State));
}

// Returns whether the bytes can be a lander's state; nothing changes otherwise.
TOUCHDOWN_EXPORT(lander_restore)
bool lander_restore(Flight* flight, const std::byte* bytes) {
  State state;
  std::memcpy(&state, bytes, sizeof(State));
  if (!engine::is_sound(state.lander)) return false;
  flight->state = state;
  report_state(*flight);
  return true;
}

}  // namespace touchdown::web
