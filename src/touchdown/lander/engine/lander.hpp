// Gymnasium's LunarLander-v3 around the physics: starts, engines, wind, observation and reward.
//
// Stock computes all of this in Python's doubles; a value becomes a float where it enters Box2D.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <type_traits>

#include "coverage.hpp"
#include "island.hpp"
#include "pcg64.hpp"
#include "world.hpp"

namespace touchdown {

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

// Full throttle is 1; `direction` is -1 for stock's action 1 and +1 for its action 3.
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

// Everything about one environment, and no pointer in it: copying its bytes is a snapshot.
struct Lander {
  Config config;
  std::uint32_t seeded;
  std::uint32_t started;
  Pcg64 rng;
  std::int64_t wind_index;
  std::int64_t torque_index;
  double shaping;     // the potential whose differences are the reward
  Throttle throttle;  // of the last step
  double fuel;        // return points that the engines have cost in this episode
  World world;        // last, for its own end is rarely looked at
};
static_assert(std::is_trivially_copyable_v<Lander>);

Lander make_lander(const Config& config);

// `entropy` is the seed in base 2^32, lowest word first.
void seed(Lander& lander, std::span<const std::uint32_t> entropy);

// A step in two halves, for whoever does the velocity iterations between them: the first says whether
// there are any to do.
bool begin_step(Lander& lander, const Throttle& throttle, Solving& solving, Coverage& coverage);
Transition finish_step(Lander& lander, bool solved, Solving& solving, Coverage& coverage);

// Instead of `begin_step`: starts an episode from where the stream of random numbers is, and begins
// the step that stock takes before anyone sees the world.
bool begin_episode(Lander& lander, Solving& solving, Coverage& coverage);

// Whether every index and count in a lander that came from outside is in range.
bool is_sound(const Lander& lander);

}  // namespace touchdown
