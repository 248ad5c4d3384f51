// Gymnasium's LunarLander-v3 around the physics: starts, engines, wind, observation and reward.
//
// Stock computes all of this in Python's doubles; a value becomes a float where it enters Box2D.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <type_traits>

#include "engine/coverage.hpp"
#include "engine/island.hpp"
#include "engine/pcg64.hpp"
#include "engine/world.hpp"

namespace touchdown::engine {

struct Config {
  double gravity = -10.0;
  double wind_power = 15.0;
  double turbulence_power = 1.5;
  std::uint32_t continuous = 0;
  std::uint32_t enable_wind = 0;

  bool operator==(const Config&) const = default;
};

inline constexpr int kNumActions = 4;
inline constexpr int kObservationSize = 8;
using Observation = std::array<float, kObservationSize>;

// Full throttle is 1. `direction` is -1 for stock's action 1 and +1 for its action 3.
struct Throttle {
  double main = 0.0;
  double side = 0.0;
  double direction = 0.0;
};

Throttle discrete_throttle(int action);
Throttle continuous_throttle(float main, float side);

struct Transition {
  Observation observation;
  double reward;
  bool terminated;
};

// The whole state of one environment. It has no pointers: copying its bytes makes a snapshot.
struct Lander {
  Config config;
  std::uint32_t seeded;
  std::uint32_t started;
  Pcg64 rng;
  std::int64_t wind_index;
  std::int64_t torque_index;
  double shaping;     // the potential whose differences are the reward
  Throttle throttle;  // of the last step
  double fuel;        // what the engines have cost in this episode, as a part of the return
  World world;        // last, as its end is rarely read
};
static_assert(std::is_trivially_copyable_v<Lander>);

Lander make_lander(const Config& config);

// `entropy` is the seed in base 2^32, lowest word first.
void seed(Lander& lander, std::span<const std::uint32_t> entropy);

// A step in two halves, with what is between them left to the caller, if the first half returns
// true: the velocity iterations, then `finish_solve` of the world.
bool begin_step(Lander& lander, const Throttle& throttle, StepState& state, Coverage& coverage);
Transition end_step(Lander& lander, Coverage& coverage);

// Instead of `begin_step`: starts an episode with the next random numbers, and begins the step that
// stock takes before it returns the first observation.
bool begin_episode(Lander& lander, StepState& state, Coverage& coverage);

// Whether every index and count is in range, in a lander whose bytes came from outside.
bool is_sound(const Lander& lander);

}  // namespace touchdown::engine
