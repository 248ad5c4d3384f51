// The Python module touchdown.agents.learners._fused.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <string>
#include <vector>

#include "fused/python/perceptron.hpp"
#include "fused/transition.hpp"
#include "simd/instruction_set.hpp"

namespace touchdown::fused {

using namespace nanobind::literals;

namespace {

nb::dict fields_of(std::int64_t observation_size) {
  if (observation_size < 1 || observation_size > kMaxSize) {
    refuse("observation_size = " + std::to_string(observation_size) + ": must be from 1 to " +
           std::to_string(kMaxSize));
  }
  const TransitionFields fields = transition_fields(static_cast<std::size_t>(observation_size));
  nb::dict offsets;
  offsets["o_tm1"] = fields.o_tm1;
  offsets["a_tm1"] = fields.a_tm1;
  offsets["r_t"] = fields.r_t;
  offsets["discount_t"] = fields.discount_t;
  offsets["terminated"] = fields.terminated;
  offsets["a_t"] = fields.a_t;
  offsets["o_t"] = fields.o_t;
  return offsets;
}

}  // namespace

NB_MODULE(_fused, m) {
  m.def(
      "simd", [] { return std::string(simd::name(simd::chosen())); },
      "The instruction set in use: avx512, avx2 or baseline.");
  m.def("transition_fields", &fields_of, "observation_size"_a,
        "Offsets of a packed transition's fields, in words of 4 bytes, by name.");
  nb::class_<Network>(m, "Network");
  nb::class_<Perceptron>(m, "Perceptron")
      .def(nb::init<std::int64_t, const std::vector<std::int64_t>&, std::int64_t, bool, bool,
                    std::int64_t, std::int64_t, double, double, bool>(),
           "num_observations"_a, "hidden_sizes"_a, "num_actions"_a, "layer_norm"_a = false,
           "dueling"_a = false, "quantiles"_a = 0, "atoms"_a = 0, "v_min"_a = 0.0, "v_max"_a = 0.0,
           "noisy"_a = false)
      .def_prop_ro("network", &Perceptron::network, nb::rv_policy::reference_internal)
      .def_prop_ro("num_params", &Perceptron::num_params)
      .def("values", &Perceptron::values, "params"_a.noconvert(), "observations"_a.noconvert(),
           "q"_a.noconvert(), "noise"_a = nb::none())
      .def("learn", &Perceptron::learn, "online"_a.noconvert(), "target"_a.noconvert().none(),
           "mu"_a.noconvert(), "nu"_a.noconvert(), "num_updates"_a, "rates"_a.noconvert(),
           "packed"_a.noconvert(), "weights"_a.noconvert().none(), "td_error"_a.noconvert(),
           "huber"_a, "double_q"_a, "sarsa"_a, "reward_scale"_a, "max_grad_norm"_a, "polyak"_a,
           "noise"_a = nb::none())
      .def("fit", &Perceptron::fit, "online"_a.noconvert(), "mu"_a.noconvert(), "nu"_a.noconvert(),
           "num_updates"_a, "rates"_a.noconvert(), "o_tm1"_a.noconvert(), "a_tm1"_a.noconvert(),
           "targets"_a.noconvert(), "order"_a.noconvert(), "td_error"_a.noconvert(), "huber"_a,
           "max_grad_norm"_a);
}

}  // namespace touchdown::fused
