// The Python module touchdown.training._train.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "train/draws.hpp"
#include "train/python/loop.hpp"
#include "train/python/pqn_loop.hpp"
#include "train/python/rollout.hpp"

namespace touchdown::train {

using namespace nanobind::literals;

namespace {

void set_schedule(Settings& settings, const std::string& name) {
  if (name == "constant") {
    settings.schedule = Schedule::kConstant;
  } else if (name == "linear") {
    settings.schedule = Schedule::kLinear;
  } else if (name == "exponential") {
    settings.schedule = Schedule::kExponential;
  } else {
    refuse("schedule = '" + name + "': must be constant, linear or exponential");
  }
}

std::string schedule_of(const Settings& settings) {
  switch (settings.schedule) {
    case Schedule::kLinear:
      return "linear";
    case Schedule::kExponential:
      return "exponential";
    case Schedule::kConstant:
      break;
  }
  return "constant";
}

// A field of a part of a class, as if it were one of the class.
template <auto part, auto field, typename Whole>
void def_part(nb::class_<Whole>& whole, const char* name) {
  using Value = std::remove_reference_t<decltype(std::declval<Whole&>().*part.*field)>;
  whole.def_prop_rw(
      name, [](const Whole& self) { return self.*part.*field; },
      [](Whole& self, Value value) { self.*part.*field = value; });
}

void bind_settings(nb::module_& m) {
  nb::class_<Settings> settings(m, "Settings");
  settings.def(nb::init<>())
      .def_prop_rw("schedule", &schedule_of, &set_schedule)
      .def_rw("epsilon_start", &Settings::epsilon_start)
      .def_rw("epsilon_end", &Settings::epsilon_end)
      .def_rw("epsilon_decay", &Settings::epsilon_decay)
      .def_rw("epsilon_duration", &Settings::epsilon_duration)
      .def_rw("min_size", &Settings::min_size)
      .def_rw("resaves", &Settings::resaves)
      .def_rw("resave_threshold", &Settings::resave_threshold)
      .def_rw("gamma", &Settings::gamma)
      .def_rw("n_step", &Settings::n_step)
      .def_rw("bootstrap_on_time_limit", &Settings::bootstrap_on_time_limit)
      .def_rw("learning_rate", &Settings::learning_rate)
      .def_rw("learning_rate_end", &Settings::learning_rate_end)
      .def_rw("learning_rate_duration", &Settings::learning_rate_duration)
      .def_rw("batch_size", &Settings::batch_size)
      .def_rw("update_period", &Settings::update_period)
      .def_rw("gradient_steps", &Settings::gradient_steps)
      .def_rw("target_period", &Settings::target_period)
      .def_rw("averaging", &Settings::averaging)
      .def_rw("metrics_period", &Settings::metrics_period)
      .def_rw("max_episode_steps", &Settings::max_episode_steps);
  settings.def_rw("prioritized", &Settings::prioritized).def_rw("seed", &Settings::seed);
  def_part<&Settings::priorities, &PrioritySettings::alpha>(settings, "alpha");
  def_part<&Settings::priorities, &PrioritySettings::beta>(settings, "beta");
  def_part<&Settings::priorities, &PrioritySettings::beta_duration>(settings, "beta_duration");
  def_part<&Settings::rollout, &RolloutSettings::rollout_steps>(settings, "rollout_steps");
  def_part<&Settings::rollout, &RolloutSettings::epochs>(settings, "epochs");
  def_part<&Settings::rollout, &RolloutSettings::minibatches>(settings, "minibatches");
  def_part<&Settings::rollout, &RolloutSettings::trace_decay>(settings, "trace_decay");
  def_part<&Settings::rule, &fused::Rule::huber>(settings, "huber");
  def_part<&Settings::rule, &fused::Rule::double_q>(settings, "double");
  def_part<&Settings::rule, &fused::Rule::sarsa>(settings, "sarsa");
  def_part<&Settings::rule, &fused::Rule::reward_scale>(settings, "reward_scale");
  def_part<&Settings::rule, &fused::Rule::max_grad_norm>(settings, "max_grad_norm");
  def_part<&Settings::rule, &fused::Rule::polyak>(settings, "polyak");
}

void bind_counts(nb::module_& m) {
  nb::class_<Counts> counts(m, "Counts");
  counts.def(nb::init<>())
      .def_rw("env_steps", &Counts::env_steps)
      .def_rw("episodes", &Counts::episodes)
      .def_rw("updates", &Counts::updates)
      .def_rw("adam_updates", &Counts::adam_updates)
      .def_rw("added", &Counts::added)
      .def_rw("filled", &Counts::filled)
      .def_rw("epsilon", &Counts::epsilon)
      .def_rw("epsilon_used", &Counts::epsilon_used)
      .def_rw("knows_values", &Counts::knows_values)
      .def_rw("ended", &Counts::ended);
  def_part<&Counts::priorities, &PriorityCounts::max_priority>(counts, "max_priority");
  def_part<&Counts::priorities, &PriorityCounts::num_batches>(counts, "num_batches");
}

void bind_arrays(nb::module_& m) {
  nb::class_<PoolArrays>(m, "PoolArrays")
      .def(nb::init<Vector<std::int64_t>, Observations, Vector<double>, Vector<bool>,
                    Vector<std::int64_t>>(),
           "actions"_a.noconvert(), "observations"_a.noconvert(), "rewards"_a.noconvert(),
           "terminated"_a.noconvert(), "steps"_a.noconvert());
  nb::class_<EpisodeArrays>(m, "EpisodeArrays")
      .def(nb::init<Observations, Vector<double>, Vector<std::int64_t>, Matrix<std::int32_t>>(),
           "observations"_a.noconvert(), "returns"_a.noconvert(), "steps"_a.noconvert(),
           "actions"_a.noconvert());
  nb::class_<WindowArrays>(m, "WindowArrays")
      .def(nb::init<Array<float, nb::shape<-1, -1, engine::kObservationSize>>, Matrix<std::int32_t>,
                    Matrix<double>, Vector<std::int64_t>>(),
           "o_tm1"_a.noconvert(), "a_tm1"_a.noconvert(), "r_t"_a.noconvert(),
           "lengths"_a.noconvert());
  nb::class_<RolloutArrays>(m, "RolloutArrays")
      .def(nb::init<Array<float, nb::shape<-1, -1, engine::kObservationSize>>, Matrix<std::int32_t>,
                    Matrix<float>, Array<float, nb::shape<-1, -1, engine::kObservationSize>>,
                    Matrix<float>, Matrix<float>>(),
           "o_tm1"_a.noconvert(), "a_tm1"_a.noconvert(), "r_t"_a.noconvert(), "o_t"_a.noconvert(),
           "terminated"_a.noconvert(), "truncated"_a.noconvert());
  nb::class_<LearnerArrays>(m, "LearnerArrays")
      .def(nb::init<Vector<float>, std::optional<Vector<float>>, Vector<float>, Vector<float>,
                    std::optional<Vector<float>>>(),
           "online"_a.noconvert(), "target"_a.noconvert().none(), "mu"_a.noconvert(),
           "nu"_a.noconvert(), "average"_a.noconvert().none() = nb::none());
}

}  // namespace

NB_MODULE(_train, m) {
  // The types `Batch` and `Network`, which a loop takes, are those modules'.
  nb::module_::import_("touchdown.lander._engine");
  nb::module_::import_("touchdown.agents.learners._fused");
  bind_settings(m);
  bind_counts(m);
  bind_arrays(m);
  nb::class_<PythonLoop>(m, "Loop")
      .def(nb::init<engine::Batch&, const nb::object&, const nb::object&, const Settings&,
                    const fused::Network&, const std::optional<MirrorTuple>&>(),
           "batch"_a, "exploration"_a, "replay"_a, "settings"_a, "network"_a,
           "mirror"_a.none() = nb::none(), nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(),
           nb::keep_alive<1, 4>())
      .def("advance", &PythonLoop::advance, "max_steps"_a, "counts"_a, "pool"_a, "episodes"_a,
           "windows"_a, "records"_a.noconvert(), "priorities"_a.noconvert().none(), "learner"_a,
           "q"_a.noconvert());
  nb::class_<PythonPqnLoop>(m, "PqnLoop")
      .def(nb::init<engine::Batch&, const nb::object&, const nb::object&, const Settings&,
                    const fused::Network&, const std::optional<MirrorTuple>&>(),
           "batch"_a, "exploration"_a, "replay"_a, "settings"_a, "network"_a,
           "mirror"_a = nb::none(), nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(),
           nb::keep_alive<1, 4>())
      .def("advance", &PythonPqnLoop::advance, "max_steps"_a, "counts"_a, "pool"_a, "episodes"_a,
           "rollout"_a, "learner"_a, "q"_a.noconvert());
  nb::class_<PythonRollout>(m, "Rollout")
      .def(nb::init<engine::Batch&, const fused::Network&, std::int64_t>(), "batch"_a, "network"_a,
           "max_episode_steps"_a, nb::keep_alive<1, 2>())
      .def("advance", &PythonRollout::advance, "max_steps"_a, "params"_a.noconvert(),
           "tasks"_a.noconvert(), "pool"_a, "episodes"_a);
  m.def(
      "random",
      [](const nb::object& bit_generator, const Vector<double>& out) {
        const BitGenerator rng = generator_of(bit_generator);
        for (std::size_t i = 0; i < out.shape(0); ++i) out(i) = draw_uniform(rng);
      },
      "bit_generator"_a, "out"_a.noconvert());
  m.def(
      "permutation",
      [](const nb::object& bit_generator, const Vector<std::int64_t>& out) {
        draw_permutation(generator_of(bit_generator), {out.data(), out.shape(0)});
      },
      "bit_generator"_a, "out"_a.noconvert());
  m.def(
      "integers",
      [](const nb::object& bit_generator, std::uint32_t high, const Vector<std::int64_t>& out) {
        if (high < 1) refuse("high = 0: must be at least 1");
        const BitGenerator rng = generator_of(bit_generator);
        for (std::size_t i = 0; i < out.shape(0); ++i) out(i) = draw_integer(rng, high);
      },
      "bit_generator"_a, "high"_a, "out"_a.noconvert());
}

}  // namespace touchdown::train
