// TD errors whose numbers can be checked in the head. The network is Q(s,·) = W·s with one weight
// per action, so that a target network is two numbers.
#include "fused/td_error.hpp"

#include <cstdint>
#include <vector>

#include "fused/kernel.hpp"
#include "tests/check.hpp"

namespace {

using namespace touchdown::fused;

// One update from the transition s = 1, a = 0, r = 1, γ = ½, s′ = 1, a′ = 1.
struct OneTransition {
  Network network = make_network(1, {}, 2, false, false);
  std::vector<float> online{5, 9, 0, 0}, target{7, 4, 0, 0}, mu = std::vector<float>(4),
                                                             nu = std::vector<float>(4);
  float o_tm1[1] = {1.0f}, r_t[1] = {1.0f}, discount_t[1] = {0.5f}, o_t[1] = {1.0f};
  std::int32_t a_tm1[1] = {0}, a_t[1] = {1};
  float td_error[1] = {};
  Samples samples{.o_tm1 = o_tm1,
                  .a_tm1 = a_tm1,
                  .r_t = r_t,
                  .discount_t = discount_t,
                  .o_t = o_t,
                  .a_t = a_t,
                  .observation_stride = 1,
                  .stride = 1};

  Metrics update(const Rule& rule, bool has_target = true) {
    const float rate = 0.0f;
    std::vector<float> workspace(updates_workspace(network, 1));
    return run_updates(network, rule,
                       {online.data(), has_target ? target.data() : nullptr, mu.data(), nu.data()},
                       samples, {.count = 1, .batch_size = 1, .rates = &rate, .td_error = td_error},
                       workspace.data());
  }
};

TEST("Q-learning bootstraps on the target network's largest value") {
  OneTransition one;
  one.update({});
  CHECK_EQUAL(one.td_error[0], -0.5f);  // 1 + ½·7 − 5
}

TEST("double Q-learning selects with the online network and evaluates with the target network") {
  OneTransition one;
  one.update({.double_q = true});
  CHECK_EQUAL(one.td_error[0], -2.0f);  // 1 + ½·4 − 5
}

TEST("Sarsa bootstraps on the action that was taken next") {
  OneTransition one;
  one.target = {7, 6, 0, 0};
  one.update({.sarsa = true});
  CHECK_EQUAL(one.td_error[0], -1.0f);  // 1 + ½·6 − 5
}

TEST("without a target network the online network bootstraps") {
  OneTransition one;
  one.update({}, false);
  CHECK_EQUAL(one.td_error[0], 0.5f);  // 1 + ½·9 − 5
}

TEST("a discount of zero cuts the bootstrap off, and a reward is scaled") {
  OneTransition one;
  one.discount_t[0] = 0.0f;
  one.update({.reward_scale = 2.0f});
  CHECK_EQUAL(one.td_error[0], -3.0f);  // 2·1 − 5
}

TEST("without a next observation the reward is the target itself, unscaled") {
  OneTransition one;
  one.samples.o_t = nullptr;
  one.update({.reward_scale = 2.0f});
  CHECK_EQUAL(one.td_error[0], -4.0f);  // 1 − 5
}

TEST("metrics tell the loss, the mean and the maximum of Q, and the gradient's norm") {
  OneTransition one;
  one.discount_t[0] = 0.0f;
  const Metrics metrics = one.update({});
  CHECK_EQUAL(metrics.loss, 16.0f);
  CHECK_EQUAL(metrics.mean_q, 7.0f);
  CHECK_EQUAL(metrics.max_q, 9.0f);
  CHECK_NEAR(metrics.gradient_norm, 8.0 * 1.41421356, 1e-5);  // 8 for the weight and 8 for the bias
}

TEST("Huber's loss is half the square up to 1, and a line beyond") {
  using namespace touchdown::fused::baseline;
  CHECK_EQUAL(loss_of(0.5f, true).value, 0.125f);
  CHECK_EQUAL(loss_of(0.5f, true).slope, -0.5f);
  CHECK_EQUAL(loss_of(-3.0f, true).value, 2.5f);
  CHECK_EQUAL(loss_of(-3.0f, true).slope, 1.0f);
  CHECK_EQUAL(loss_of(3.0f, true).slope, -1.0f);
}

TEST("the squared loss has no knee") {
  using namespace touchdown::fused::baseline;
  CHECK_EQUAL(loss_of(3.0f, false).value, 9.0f);
  CHECK_EQUAL(loss_of(3.0f, false).slope, -6.0f);
}

TEST("an order picks the samples of a minibatch") {
  OneTransition one;
  const float o_tm1[] = {100.0f, 1.0f}, targets[] = {100.0f, 6.0f};
  const std::int32_t actions[] = {1, 0};
  const std::int64_t order[] = {1};
  one.samples = {.o_tm1 = o_tm1,
                 .a_tm1 = actions,
                 .r_t = targets,
                 .observation_stride = 1,
                 .stride = 1,
                 .order = order};
  one.update({});
  CHECK_EQUAL(one.td_error[0], 1.0f);  // 6 − 5
}

}  // namespace

int main() { return touchdown::check::run_all(); }
