// The Python module touchdown.lander._engine.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <string>

#include "engine/pcg64.hpp"
#include "engine/python/arguments.hpp"
#include "engine/python/batch.hpp"
#include "engine/python/inspection.hpp"
#include "engine/terrain.hpp"
#include "simd/instruction_set.hpp"

namespace touchdown::engine {

using namespace nanobind::literals;

NB_MODULE(_engine, m) {
  m.doc() = "LunarLander-v3, bit for bit as stock Gymnasium computes it.";
  nb::class_<Pcg64>(m, "Pcg64", "NumPy's default generator, as the lander draws from it.")
      .def(
          "__init__",
          [](Pcg64* rng, const nb::int_& seed) { new (rng) Pcg64(Pcg64::seeded(entropy(seed))); },
          "seed"_a)
      .def("uniform", &Pcg64::uniform, "low"_a, "high"_a)
      .def("integers", &Pcg64::integers, "low"_a, "high"_a, "An integer in [low, high).");

  nb::class_<Batch>(m, "Batch",
                    "Landers stepped together, in SIMD lanes; each flies as it would alone.")
      .def(
          "__init__",
          [](Batch* batch, std::int64_t num_envs, std::int64_t num_threads, bool continuous,
             double gravity, bool enable_wind, double wind_power, double turbulence_power) {
            const std::size_t count = need_positive(num_envs, "num_envs");
            const std::size_t threads = need_positive(num_threads, "num_threads");
            if (threads > kMaxThreads) {
              refuse("num_threads = " + std::to_string(threads) + ": must be at most " +
                     std::to_string(kMaxThreads));
            }
            new (batch) Batch(
                count, threads,
                checked_config(continuous, gravity, enable_wind, wind_power, turbulence_power));
          },
          "num_envs"_a, nb::kw_only(), "num_threads"_a = 1, "continuous"_a = false,
          "gravity"_a = -10.0, "enable_wind"_a = false, "wind_power"_a = 15.0,
          "turbulence_power"_a = 1.5)
      .def("__len__", [](const Batch& batch) { return batch.landers.size(); })
      .def(
          "seed",
          [](Batch& batch, std::int64_t index, const nb::int_& seed_given) {
            const auto words = entropy(seed_given);
            seed(lander_at(batch, index), words);
          },
          "index"_a, "seed"_a, "Restarts one lander's stream of random numbers.")
      .def("step", &step_batch<DiscreteActions>, "actions"_a.noconvert(),
           "observations"_a.noconvert(), "rewards"_a.noconvert(), "terminated"_a.noconvert(),
           "tasks"_a.noconvert() = nb::none(),
           "Carries out each lander's task (0 nothing, 1 step, 2 begin an episode) and writes the "
           "results "
           "in place.")
      .def("step", &step_batch<ContinuousActions>, "actions"_a.noconvert(),
           "observations"_a.noconvert(), "rewards"_a.noconvert(), "terminated"_a.noconvert(),
           "tasks"_a.noconvert() = nb::none())
      .def("step_episodes", &step_episodes<DiscreteActions>, "actions"_a.noconvert(),
           "observations"_a.noconvert(), "rewards"_a.noconvert(), "terminated"_a.noconvert(),
           "truncated"_a.noconvert(), "steps"_a.noconvert(), "ended"_a.noconvert(), "limit"_a,
           "Steps every lander, or begins its next episode if its last one has ended; also counts "
           "the steps of the episodes, and truncates them at the limit.")
      .def("step_episodes", &step_episodes<ContinuousActions>, "actions"_a.noconvert(),
           "observations"_a.noconvert(), "rewards"_a.noconvert(), "terminated"_a.noconvert(),
           "truncated"_a.noconvert(), "steps"_a.noconvert(), "ended"_a.noconvert(), "limit"_a)
      .def("snapshot", &snapshot_one, "index"_a, "The whole state of one lander as bytes.")
      .def("restore", &restore_one, "index"_a, "snapshot"_a,
           "Takes one lander's state from bytes; ValueError if they are of other settings.")
      .def("copy", &copy_to, "index"_a, "to"_a, "Copies one lander's state to others.")
      .def(
          "states", &read_states, "bodies"_a.noconvert(), "leg_contacts"_a.noconvert(),
          "awake"_a.noconvert(), "engines"_a.noconvert(),
          "Writes x, y, angle and their rates of hull, leg 0 and leg 1 [N, 3, 6], whether each leg "
          "touches the ground as stock reports it [N, 2], whether the hull is awake [N], and the "
          "last step's main and side throttle with the episode's fuel [N, 3].")
      .def("terrain", &read_terrain, "index"_a, "points"_a.noconvert(),
           "Writes the points of one lander's surface from left to right, metres, [11, 2].")
      .def("coverage", &coverage_of, "Counts of the rare paths taken since the batch was made.");

  m.def(
      "simd", [] { return std::string(simd::name(simd::chosen())); },
      "The instruction set in use: avx512, avx2 or baseline.");
  m.attr("HELIPAD") = nb::make_tuple(kHelipadLeft, kHelipadRight, kHelipadHeight);
}

}  // namespace touchdown::engine
