#include "fused/optimizer.hpp"

#include <cmath>
#include <vector>

#include "fused/learning.hpp"
#include "tests/check.hpp"

namespace {

using namespace touchdown::fused;
using namespace touchdown::fused::baseline;

struct State {
  explicit State(std::size_t count) : online(count), target(count), mu(count), nu(count) {}
  Learner learner() { return {online.data(), target.data(), mu.data(), nu.data()}; }

  std::vector<float> online, target, mu, nu;
};

TEST("bias corrections are one minus powers of the decay rates") {
  const Rule rule{.b1 = 0.5f, .b2 = 0.75f};
  const StepSize step = step_size(rule, 0.1f, 2.0);
  CHECK_EQUAL(step.rate, 0.1f);
  CHECK_EQUAL(step.correction1, 0.75f);
  CHECK_EQUAL(step.correction2, 0.4375f);
}

TEST("Adam's first step is the step size against the gradient's sign, whatever its length") {
  const Rule rule;
  State state(2);
  const float gradient[] = {1000.0f, -0.01f};
  adam_step(rule, state.learner(), step_size(rule, 0.25f, 1.0), gradient, 1.0f, 2);
  CHECK_NEAR(state.online[0], -0.25, 1e-5);
  CHECK_NEAR(state.online[1], 0.25, 1e-5);
}

TEST("Adam's second step can be followed by hand") {
  // β₁ = ½, β₂ = ¾, gradients 4 and then 0: m = 2, then 1; v = 4, then 3.
  const Rule rule{.b1 = 0.5f, .b2 = 0.75f};
  State state(1);
  const float first[] = {4.0f}, second[] = {0.0f};
  adam_step(rule, state.learner(), step_size(rule, 1.0f, 1.0), first, 1.0f, 1);
  CHECK_EQUAL(state.mu[0], 2.0f);
  CHECK_EQUAL(state.nu[0], 4.0f);
  CHECK_NEAR(state.online[0], -1.0, 1e-6);  // (2/½) / √(4/¼)
  adam_step(rule, state.learner(), step_size(rule, 1.0f, 2.0), second, 1.0f, 1);
  CHECK_EQUAL(state.mu[0], 1.0f);
  CHECK_EQUAL(state.nu[0], 3.0f);
  CHECK_NEAR(state.online[0], -1.0 - (1.0 / 0.75) / std::sqrt(3.0 / 0.4375), 1e-6);
}

TEST("the norm is over all parameters, in whole vectors or not") {
  std::vector<float> gradient(2 * kWidth + 1, 0.0f);
  gradient.front() = 3.0f;
  gradient.back() = 4.0f;
  CHECK_EQUAL(global_norm(gradient.data(), static_cast<std::ptrdiff_t>(gradient.size())), 5.0f);
}

TEST("gradient clipping shortens a gradient that is too long, and no other") {
  CHECK_EQUAL(clipping_factor(5.0f, 1.0f), 0.2f);
  CHECK_EQUAL(clipping_factor(0.5f, 1.0f), 1.0f);
  CHECK_EQUAL(clipping_factor(5.0f, 0.0f), 1.0f);  // 0 is no maximum
}

TEST("Adam steps along the clipped gradient") {
  const Rule rule{.b1 = 0.5f};
  State state(2);
  const float gradient[] = {3.0f, 4.0f};
  adam_step(rule, state.learner(), step_size(rule, 0.25f, 1.0), gradient,
            clipping_factor(global_norm(gradient, 2), 1.0f), 2);
  CHECK_NEAR(state.mu[0], 0.5 * 0.6, 1e-6);
  CHECK_NEAR(state.mu[1], 0.5 * 0.8, 1e-6);
}

TEST("a soft update moves the target by a share of its distance") {
  State state(1);
  state.online[0] = 3.0f;
  state.target[0] = 1.0f;
  soft_update(0.25f, state.learner(), 1);
  CHECK_EQUAL(state.target[0], 1.5f);
  CHECK_EQUAL(state.online[0], 3.0f);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
