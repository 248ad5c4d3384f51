#include "engine/lander.hpp"

#include <algorithm>
#include <cmath>

#include "engine/world_step.hpp"

namespace touchdown::engine {

namespace {

constexpr double kFramesPerSecond = 50;
constexpr double kMainEnginePower = 13.0;
constexpr double kSideEnginePower = 0.6;
constexpr double kMainEngineDrop = 4 / kScale;
constexpr double kInitialForce = 1000.0;
constexpr double kLegDown = 18 / kScale;
constexpr double kPythonPi = 3.141592653589793;

Vec2 to_float(double x, double y) { return {static_cast<float>(x), static_cast<float>(y)}; }

// Stock's wind: a smooth force between -1 and 1 that never repeats.
double gust(std::int64_t index) {
  const auto t = static_cast<double>(index);
  return std::tanh(std::sin(0.02 * t) + std::sin(kPythonPi * 0.01 * t));
}

void apply_wind(Lander& lander) {
  const auto& legs = lander.world.contact_flags.legs;
  if (lander.config.enable_wind == 0 || legs[0] != 0 || legs[1] != 0) return;
  Body& hull = lander.world.bodies[kHull];
  wake(hull);
  hull.force += to_float(gust(lander.wind_index++) * lander.config.wind_power, 0.0);
  hull.torque += static_cast<float>(gust(lander.torque_index++) * lander.config.turbulence_power);
}

void fire(Body& hull, double x, double y, double power, double throttle, double point_x,
          double point_y) {
  apply_impulse(hull, kShapes[kHull], to_float(-x * power * throttle, -y * power * throttle),
                to_float(point_x, point_y));
}

void apply_engines(Lander& lander, const Throttle& throttle) {
  Body& hull = lander.world.bodies[kHull];
  const double angle = hull.sweep.angle;
  const double tip[2] = {std::sin(angle), std::cos(angle)};
  const double side[2] = {-tip[1], tip[0]};
  // Drawn whether or not an engine fires: the random stream must not depend on the action.
  const double noise_0 = lander.rng.uniform(-1.0, 1.0) / kScale;
  const double noise_1 = lander.rng.uniform(-1.0, 1.0) / kScale;
  const double at_x = hull.transform.origin.x;
  const double at_y = hull.transform.origin.y;

  if (throttle.main > 0.0) {
    const double down = kMainEngineDrop + 2 * noise_0;
    const double x = tip[0] * down + side[0] * noise_1;
    const double y = -tip[1] * down - side[1] * noise_1;
    fire(hull, x, y, kMainEnginePower, throttle.main, at_x + x, at_y + y);
  }
  if (throttle.side > 0.0) {
    const double out = 3 * noise_1 + throttle.direction * 12 / kScale;
    const double x = tip[0] * noise_0 + side[0] * out;
    const double y = -tip[1] * noise_0 - side[1] * out;
    // Upstream uses 17 for one axis and 14 for the other; kept for parity.
    fire(hull, x, y, kSideEnginePower, throttle.side, at_x + x - tip[0] * 17 / kScale,
         at_y + y + tip[1] * 14 / kScale);
  }
}

// The observation in double precision; the reward is computed from it.
std::array<double, kObservationSize> observe(const World& world) {
  constexpr double half_width = kViewportWidth / kScale / 2;
  constexpr double half_height = kViewportHeight / kScale / 2;
  const Body& hull = world.bodies[kHull];
  const double x = hull.transform.origin.x;
  const double y = hull.transform.origin.y;
  const double vx = hull.linear_velocity.x;
  const double vy = hull.linear_velocity.y;
  const double angular_velocity = hull.angular_velocity;
  return {(x - half_width) / half_width,
          (y - (kHelipadHeight + kLegDown)) / half_height,
          vx * half_width / kFramesPerSecond,
          vy * half_height / kFramesPerSecond,
          hull.sweep.angle,
          20.0 * angular_velocity / kFramesPerSecond,
          world.contact_flags.legs[0] != 0 ? 1.0 : 0.0,
          world.contact_flags.legs[1] != 0 ? 1.0 : 0.0};
}

double potential(const std::array<double, kObservationSize>& s) {
  return -100 * std::sqrt(s[0] * s[0] + s[1] * s[1]) - 100 * std::sqrt(s[2] * s[2] + s[3] * s[3]) -
         100 * std::fabs(s[4]) + 10 * s[6] + 10 * s[7];
}

}  // namespace

Throttle discrete_throttle(int action) {
  if (action == 2) return {.main = 1.0};
  if (action == 1 || action == 3)
    return {.side = 1.0, .direction = static_cast<double>(action - 2)};
  return {};
}

Throttle continuous_throttle(float main_action, float side_action) {
  const double main = std::clamp(main_action, -1.0f, 1.0f);
  const double side = std::clamp(side_action, -1.0f, 1.0f);
  Throttle throttle;
  if (main > 0.0) throttle.main = (main + 1.0) * 0.5;  // an engine burns at half power or more
  if (std::fabs(side) > 0.5) {
    throttle.side = std::fabs(side);
    throttle.direction = side < 0.0 ? -1.0 : 1.0;
  }
  return throttle;
}

Lander make_lander(const Config& config) {
  Lander lander{};
  lander.config = config;
  return lander;
}

void seed(Lander& lander, std::span<const std::uint32_t> entropy) {
  lander.rng = Pcg64::seeded(entropy);
  lander.seeded = 1;
}

bool begin_episode(Lander& lander, StepState& state, Coverage& coverage) {
  const Terrain terrain = make_terrain(lander.rng);
  lander.world = make_world(terrain, static_cast<float>(lander.config.gravity));
  const double force_x = lander.rng.uniform(-kInitialForce, kInitialForce);
  const double force_y = lander.rng.uniform(-kInitialForce, kInitialForce);
  lander.world.bodies[kHull].force += to_float(force_x, force_y);
  if (lander.config.enable_wind != 0) {
    lander.wind_index = lander.rng.integers(-9999, 9999);
    lander.torque_index = lander.rng.integers(-9999, 9999);
  }
  lander.fuel = 0.0;
  lander.started = 1;
  return begin_step(lander, {}, state, coverage);
}

bool begin_step(Lander& lander, const Throttle& throttle, StepState& state, Coverage& coverage) {
  apply_wind(lander);
  apply_engines(lander, throttle);
  lander.throttle = throttle;
  return begin_step(lander.world, state, coverage);
}

Transition end_step(Lander& lander, Coverage& coverage) {
  end_step(lander.world, coverage);

  const auto observed = observe(lander.world);
  if (observed[6] + observed[7] == 1.0) ++coverage.one_leg_steps;
  const double before = lander.shaping;
  lander.shaping = potential(observed);

  Transition transition;
  std::transform(observed.begin(), observed.end(), transition.observation.begin(),
                 [](double value) { return static_cast<float>(value); });
  const double main_cost = lander.throttle.main * 0.30;
  const double side_cost = lander.throttle.side * 0.03;
  lander.fuel += main_cost + side_cost;
  transition.reward = lander.shaping - before - main_cost - side_cost;
  transition.terminated = false;
  if (lander.world.contact_flags.hull != 0 || std::fabs(observed[0]) >= 1.0) {
    transition.terminated = true;
    transition.reward = -100.0;
  }
  if (lander.world.bodies[kHull].awake == 0) {
    transition.terminated = true;
    transition.reward = 100.0;
  }
  return transition;
}

bool is_sound(const Lander& lander) {
  const Contacts& contacts = lander.world.contacts;
  if (contacts.count < 0 || contacts.count > kMaxContacts) return false;
  // Far beyond any flight, and far from overflow.
  constexpr std::int64_t most_gusts = std::int64_t{1} << 53;
  for (const std::int64_t index : {lander.wind_index, lander.torque_index}) {
    if (index < -most_gusts || index > most_gusts) return false;
  }
  const auto end = contacts.items.begin() + contacts.count;
  // There is room for one contact of each pair.
  for (auto contact = contacts.items.begin(); contact != end; ++contact) {
    const auto is_twin = [contact](const Contact& other) {
      return other.body == contact->body && other.edge == contact->edge;
    };
    if (std::any_of(contact + 1, end, is_twin)) return false;
  }
  const auto legs = lander.world.joints;
  return std::all_of(contacts.items.begin(), end,
                     [](const Contact& contact) {
                       return contact.body < kNumBodies && contact.edge < kNumEdges &&
                              contact.manifold.count <= 2 &&
                              contact.manifold.face <= Face::kPolygon;
                     }) &&
         std::all_of(legs.begin(), legs.end(),
                     [](const Joint& joint) { return joint.limit <= LimitState::kUpper; });
}

}  // namespace touchdown::engine
