#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments.hpp"
#include "batch_bindings.hpp"
#include "lander.hpp"
#include "snapshot.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace touchdown {
namespace {

template <typename T>
nb::object array(const std::vector<T>& values, std::initializer_list<std::size_t> shape) {
  T* data = new T[values.size()];
  std::copy(values.begin(), values.end(), data);
  nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T>(data, shape, owner));
}

nb::object to_array(const Observation& observation) {
  return array(std::vector<float>(observation.begin(), observation.end()), {observation.size()});
}

[[noreturn]] void refuse(const char* wanted, nb::handle action) {
  throw nb::value_error(
      ("an action is " + std::string(wanted) + ", got " + nb::repr(action).c_str()).c_str());
}

Throttle throttle_of(const Config& config, nb::handle action) {
  if (config.continuous == 0) {
    const char* wanted = "a whole number from 0 to 3";
    std::int64_t number = -1;
    if (!nb::try_cast(action, number) || number < 0 || number >= kNumActions) {
      refuse(wanted, action);
    }
    return discrete_throttle(static_cast<int>(number));
  }
  const char* wanted = "a pair of numbers (main engine, side engine)";
  float pair[2];
  if (nb::ndarray<const float, nb::shape<2>, nb::device::cpu> values;
      nb::try_cast(action, values)) {
    pair[0] = values(0);
    pair[1] = values(1);
  } else if (nb::isinstance<nb::sequence>(action) && nb::len(action) == 2) {
    for (std::size_t i = 0; i < 2; ++i) {
      if (!nb::try_cast(action[i], pair[i])) refuse(wanted, action);
    }
  } else {
    refuse(wanted, action);
  }
  if (std::isnan(pair[0]) || std::isnan(pair[1])) refuse(wanted, action);
  return continuous_throttle(pair[0], pair[1]);
}

nb::object reset_lander(Lander& lander, const std::optional<nb::int_>& seed_given) {
  seed_or_go_on(lander, seed_given);
  return to_array(reset(lander));
}

void need_start(const Lander& lander) {
  if (lander.started == 0) throw std::runtime_error("reset the lander before its first step");
}

nb::tuple step_lander(Lander& lander, nb::handle action) {
  need_start(lander);
  const Transition t = step(lander, throttle_of(lander.config, action));
  return nb::make_tuple(to_array(t.observation), t.reward, t.terminated);
}

template <typename Get>
nb::object per_body(const Lander& lander, Get get) {
  std::vector<float> values;
  for (const Body& body : lander.world.bodies) values.push_back(get(body));
  return array(values, {kNumBodies});
}

template <typename Get>
nb::object per_body_xy(const Lander& lander, Get get) {
  std::vector<float> values;
  for (const Body& body : lander.world.bodies) {
    values.push_back(get(body).x);
    values.push_back(get(body).y);
  }
  return array(values, {kNumBodies, 2});
}

nb::object terrain_of(const Lander& lander) {
  std::vector<double> points;
  for (int i = 0; i < kNumHeights; ++i) {
    points.push_back(kChunk * i);
    points.push_back(lander.world.terrain.heights[i]);
  }
  return array(points, {kNumHeights, 2});
}

template <std::size_t N>
nb::tuple counts(const std::array<std::uint64_t, N>& values) {
  nb::list list;
  for (const std::uint64_t value : values) list.append(value);
  return nb::tuple(list);
}

nb::dict coverage_of(const Lander& lander) {
  const Coverage& c = lander.coverage;
  nb::dict d;
  d["steps"] = c.steps;
  d["steps_with_impacts"] = counts(c.steps_with_impacts);
  d["steps_with_contacts"] = counts(c.steps_with_contacts);
  d["impacts_undone"] = c.impacts_undone;
  d["all_position_iterations"] = c.all_position_iterations;
  d["one_point_manifolds"] = c.one_point_manifolds;
  d["two_point_manifolds"] = c.two_point_manifolds;
  d["redundant_points"] = c.redundant_points;
  d["block_cases"] = counts(c.block_cases);
  d["limit_switches"] = c.limit_switches;
  d["fell_asleep"] = c.fell_asleep;
  d["woke_up"] = c.woke_up;
  d["one_leg_steps"] = c.one_leg_steps;
  d["most_pairs"] = c.most_pairs;
  return d;
}

nb::bytes snapshot_lander(const Lander& lander) {
  const auto bytes = snapshot(lander);
  return nb::bytes(bytes.data(), bytes.size());
}

void restore_lander(Lander& lander, const nb::bytes& bytes) {
  lander = restored({static_cast<const std::byte*>(bytes.data()), bytes.size()}, lander.config);
}

}  // namespace

NB_MODULE(_engine, m) {
  m.doc() = "LunarLander-v3, bit for bit as stock Gymnasium computes it.";
  nb::class_<Pcg64>(m, "Pcg64", "NumPy's default generator, as the lander draws from it.")
      .def(
          "__init__",
          [](Pcg64* rng, const nb::int_& seed) { new (rng) Pcg64(Pcg64::seeded(entropy(seed))); },
          "seed"_a)
      .def("uniform", &Pcg64::uniform, "low"_a, "high"_a)
      .def("integers", &Pcg64::integers, "low"_a, "high"_a, "A whole number in [low, high).");

  nb::class_<Lander>(m, "Lander", "One environment: stock's step and reset without the time limit.")
      .def(
          "__init__",
          [](Lander* lander, bool continuous, double gravity, bool enable_wind, double wind_power,
             double turbulence_power) {
            new (lander)
                Lander(make_lander(checked_config(
                    continuous, gravity, enable_wind, wind_power, turbulence_power)));
          },
          nb::kw_only(), "continuous"_a = false, "gravity"_a = -10.0, "enable_wind"_a = false,
          "wind_power"_a = 15.0, "turbulence_power"_a = 1.5)
      .def("reset", &reset_lander, "seed"_a = nb::none(),
           "Starts an episode; without a seed the stream of random numbers goes on.")
      .def("step", &step_lander, "action"_a.none(), "Gives (observation, reward, terminated).")
      .def("snapshot", &snapshot_lander, "The whole state as bytes.")
      .def("restore", &restore_lander, "snapshot"_a,
           "Takes a state from bytes; ValueError if they are not a lander of these settings.")
      .def_prop_ro(
          "origins",
          [](const Lander& l) {
            return per_body_xy(l, [](const Body& b) { return b.transform.origin; });
          },
          "Positions of hull, leg 0 and leg 1 in metres, [3, 2].")
      .def_prop_ro(
          "angles",
          [](const Lander& l) { return per_body(l, [](const Body& b) { return b.sweep.angle; }); },
          "Radians, [3].")
      .def_prop_ro(
          "velocities",
          [](const Lander& l) { return per_body_xy(l, [](const Body& b) { return b.velocity; }); },
          "Of the centres of mass, metres a second, [3, 2].")
      .def_prop_ro(
          "spins",
          [](const Lander& l) { return per_body(l, [](const Body& b) { return b.spin; }); },
          "Radians a second, [3].")
      .def_prop_ro("leg_contacts",
                   [](const Lander& l) {
                     const auto& legs = l.world.touches.legs;
                     return nb::make_tuple(legs[0] != 0, legs[1] != 0);
                   })
      .def_prop_ro("awake", [](const Lander& l) { return l.world.bodies[kHull].awake != 0; })
      .def_prop_ro("terrain", &terrain_of, "Points of the surface from left to right, [11, 2].")
      .def_prop_ro(
          "engine_powers",
          [](const Lander& l) {
            return nb::make_tuple(l.throttle.main, l.throttle.side * l.throttle.direction);
          },
          "Main and side engine in the last step; the side's sign is its direction.")
      .def_prop_ro("coverage", &coverage_of, "Counts of rare paths since the lander was made.");

  bind_batch(m);
  m.attr("HELIPAD") = nb::make_tuple(kHelipadLeft, kHelipadRight, kHelipadHeight);
}

}  // namespace touchdown
