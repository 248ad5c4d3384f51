#include "fused/network.hpp"

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "fused/learning.hpp"
#include "fused/transition.hpp"
#include "tests/check.hpp"

namespace {

using namespace touchdown::fused;

Network of(const std::vector<std::int64_t>& hidden_sizes, bool layer_norm, bool dueling) {
  return make_network(3, hidden_sizes, 2, layer_norm, dueling);
}

TEST("a linear network has its weight first, then its bias") {
  const Network network = of({}, false, false);
  CHECK_EQUAL(network.advantage.weight, 0);
  CHECK_EQUAL(network.advantage.bias, 6);
  CHECK_EQUAL(network.num_params, 8);
}

TEST("a layer's gain and shift follow its bias, and a dueling head's value comes first") {
  const Network network = of({4}, true, true);
  CHECK_EQUAL(network.hidden[0].linear.bias, 12);
  CHECK_EQUAL(network.hidden[0].gain, 16);
  CHECK_EQUAL(network.hidden[0].shift, 20);
  CHECK_EQUAL(network.value.weight, 24);
  CHECK_EQUAL(network.value.bias, 28);
  CHECK_EQUAL(network.advantage.weight, 29);
  CHECK_EQUAL(network.advantage.bias, 37);
  CHECK_EQUAL(network.num_params, 39);
}

TEST("a prediction of a distribution gives each action several outputs, and the value as well") {
  const Network network = make_network(3, std::vector<std::int64_t>{4}, 2, false, true,
                                       make_prediction(5, 0, 0.0, 0.0));
  CHECK_EQUAL(network.value.out, 5);
  CHECK_EQUAL(network.advantage.out, 10);
  CHECK_EQUAL(network.num_params, 16 + 25 + 50);
}

TEST("predictions that make no sense are refused") {
  CHECK_THROWS(std::invalid_argument, make_prediction(8, 8, 0.0, 1.0));
  CHECK_THROWS(std::invalid_argument, make_prediction(-1, 0, 0.0, 1.0));
  CHECK_THROWS(std::invalid_argument, make_prediction(0, 1, 0.0, 1.0));
  CHECK_THROWS(std::invalid_argument, make_prediction(0, 8, 1.0, 1.0));
  CHECK_THROWS(std::invalid_argument,
               make_network(3, {}, kMaxSize / 2, false, false, make_prediction(3, 0, 0.0, 0.0)));
}

TEST("the widest layer counts inputs and outputs too") {
  CHECK_EQUAL(of({}, false, false).widest, 3);
  CHECK_EQUAL(of({2, 9, 4}, false, false).widest, 9);
}

TEST("sizes out of range are refused") {
  CHECK_THROWS(std::invalid_argument, of({0}, false, false));
  CHECK_THROWS(std::invalid_argument, of({kMaxSize + 1}, false, false));
  CHECK_THROWS(std::invalid_argument, of(std::vector<std::int64_t>(17, 4), false, false));
}

TEST("a packed transition has two observations around five numbers") {
  constexpr TransitionFields fields = transition_fields(3);
  CHECK_EQUAL(fields.o_tm1, 0u);
  CHECK_EQUAL(fields.a_tm1, 3u);
  CHECK_EQUAL(fields.r_t, 4u);
  CHECK_EQUAL(fields.discount_t, 5u);
  CHECK_EQUAL(fields.terminated, 6u);
  CHECK_EQUAL(fields.a_t, 7u);
  CHECK_EQUAL(fields.o_t, 8u);
  CHECK_EQUAL(fields.size, 11u);
}

TEST("samples of packed transitions are read field by field") {
  std::vector<float> packed(2 * 11);
  for (std::size_t i = 0; i < packed.size(); ++i) packed[i] = static_cast<float>(i);
  const std::int32_t action = 1;
  std::memcpy(&packed[11 + 3], &action, sizeof action);
  const Samples samples = packed_samples(packed.data(), 3);
  CHECK_EQUAL(samples.o_tm1[samples.observation_stride], 11.0f);
  CHECK_EQUAL(samples.a_tm1[samples.stride], 1);
  CHECK_EQUAL(samples.r_t[samples.stride], 15.0f);
  CHECK_EQUAL(samples.discount_t[samples.stride], 16.0f);
  CHECK_EQUAL(samples.o_t[samples.observation_stride], 19.0f);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
