// Predicted distributions in the baseline kernel, with numbers that can be checked in the head. One
// column of a panel is checked, and the others hold decoys.
#include <cmath>
#include <vector>

#include "fused/distribution_error.hpp"
#include "fused/exponential.hpp"
#include "fused/prediction.hpp"
#include "tests/check.hpp"

namespace {

using namespace touchdown::fused;
using namespace touchdown::fused::baseline;

constexpr int kLane = 1;

// A panel with these outputs in one lane of its second vector, and decoys elsewhere.
std::vector<float> panel_of(const std::vector<float>& outputs) {
  std::vector<float> panel;
  for (const float output : outputs) {
    for (int c = 0; c < kPanel; ++c) {
      panel.push_back(c == kWidth + kLane ? output : 3.0f + static_cast<float>(c) * output);
    }
  }
  return panel;
}

float* second(std::vector<float>& panel) { return panel.data() + kWidth; }

float output(const std::vector<float>& panel, int i) {
  return panel[static_cast<std::size_t>(i * kPanel + kWidth + kLane)];
}

TEST("the exponential is the library's to two units in the last place") {
  for (double x = 0.0; x > -87.0; x -= 0.0137) {
    const auto rounded = static_cast<float>(x);
    const double expected = std::exp(static_cast<double>(rounded));
    CHECK_NEAR(exponential(broadcast(rounded))[kLane], expected, 2.4e-7 * expected);
  }
  CHECK_EQUAL(exponential(broadcast(0.0f))[kLane], 1.0f);
}

TEST("the exponential of what is far below is as good as zero, and NaN stays NaN") {
  CHECK_NEAR(exponential(broadcast(-1e30f))[kLane], 0.0, 1e-37);
  CHECK_NEAR(exponential(broadcast(-INFINITY))[kLane], 0.0, 1e-37);
  CHECK(std::isnan(exponential(broadcast(NAN))[kLane]));
}

TEST("probabilities depend on differences of logits, however large these are") {
  std::vector<float> logits = panel_of({5000.0f, 5000.0f + std::log(3.0f)});
  softmax(second(logits), 2, second(logits));
  CHECK_NEAR(output(logits, 0), 0.25, 1e-4);
  CHECK_NEAR(output(logits, 1), 0.75, 1e-4);
}

TEST("the mean return is the mean of quantiles, or that of atoms with their probabilities") {
  std::vector<float> quantiles = panel_of({1.0f, 2.0f, 6.0f});
  CHECK_EQUAL(mean_return(make_prediction(3, 0, 0.0, 0.0), second(quantiles))[kLane], 3.0f);
  // probabilities ¼, ¼ and ½ of −2, 1 and 4
  std::vector<float> logits = panel_of({0.0f, 0.0f, std::log(2.0f)});
  CHECK_NEAR(mean_return(make_prediction(0, 3, -2.0, 4.0), second(logits))[kLane], 1.75, 1e-6);
  CHECK_NEAR(output(logits, 2), 0.5, 1e-6);
}

TEST("each quantile is pulled to its share of the targets") {
  // the target is 1 + 0·θ′; of θ = (0, 2), the errors are 1 with τ = ¼, and −1 with |τ − 1| = ¼
  std::vector<float> taken = panel_of({0.0f, 2.0f}), next = panel_of({7.0f, -7.0f});
  const Vector loss = quantile_loss(2, broadcast(1.0f), broadcast(0.0f), broadcast(2.0f),
                                    second(taken), second(next));
  CHECK_EQUAL(loss[kLane], 0.25f);               // ¼·½ + ¼·½
  CHECK_EQUAL(output(taken, 0), -2.0f * 0.25f);  // the weight is 2
  CHECK_EQUAL(output(taken, 1), 2.0f * 0.25f);
  CHECK_EQUAL(output(next, 0), 1.0f);
}

TEST("the quantile loss is linear in large errors") {
  // errors 5 and −3 of both quantiles θ = 0, with τ = ¼ and τ = ¾
  std::vector<float> taken = panel_of({0.0f, 0.0f}), next = panel_of({5.0f, -3.0f});
  const Vector loss = quantile_loss(2, broadcast(0.0f), broadcast(1.0f), broadcast(1.0f),
                                    second(taken), second(next));
  CHECK_EQUAL(loss[kLane], 3.5f);        // Σᵢ ½·(τᵢ·4½ + (1 − τᵢ)·2½)
  CHECK_EQUAL(output(taken, 0), 0.25f);  // −½·(¼ − ¾)
  CHECK_EQUAL(output(taken, 1), -0.25f);
}

TEST("a share falls from one atom to its neighbours, and NaN stays NaN") {
  CHECK_EQUAL(share_at(broadcast(0.0f))[kLane], 1.0f);
  CHECK_EQUAL(share_at(broadcast(-0.25f))[kLane], 0.75f);
  CHECK_EQUAL(share_at(broadcast(0.25f))[kLane], 0.75f);
  CHECK_EQUAL(share_at(broadcast(-2.0f))[kLane], 0.0f);
  CHECK(std::isnan(share_at(broadcast(NAN))[kLane]));
  CHECK(std::isnan(share_at(broadcast(-NAN))[kLane]));
}

TEST("a return between two atoms is shared between them") {
  // atoms −1, 0 and 1; the target is ½ whatever follows
  std::vector<float> taken = panel_of({5.0f, 5.0f, 5.0f}), work(6 * kPanel);
  std::vector<float> next = panel_of({0.25f, 0.5f, 0.25f});
  const CategoricalLoss found =
      categorical_loss(make_prediction(0, 3, -1.0, 1.0), broadcast(0.5f), broadcast(0.0f),
                       broadcast(6.0f), second(taken), second(next), second(work));
  CHECK_NEAR(found.loss[kLane], std::log(3.0), 1e-6);
  CHECK_NEAR(found.target[kLane], 0.5, 1e-6);
  CHECK_NEAR(output(taken, 0), 6.0 / 3.0, 1e-6);  // weight·(⅓ − 0)
  CHECK_NEAR(output(taken, 1), 6.0 * (1.0 / 3.0 - 0.5), 1e-6);
  CHECK_NEAR(output(taken, 2), 6.0 * (1.0 / 3.0 - 0.5), 1e-6);
}

TEST("returns beyond the atoms count as the last one") {
  std::vector<float> taken = panel_of({0.0f, 0.0f, 0.0f}), work(6 * kPanel);
  std::vector<float> next = panel_of({0.25f, 0.5f, 0.25f});
  // 0.75 + ½·(−1, 0, 1) is 0.25, 0.75 and 1.25
  const CategoricalLoss found =
      categorical_loss(make_prediction(0, 3, -1.0, 1.0), broadcast(0.75f), broadcast(0.5f),
                       broadcast(1.0f), second(taken), second(next), second(work));
  CHECK_NEAR(found.target[kLane], 0.25 * 0.25 + 0.5 * 0.75 + 0.25 * 1.0, 1e-6);
  CHECK_NEAR(output(taken, 0), 1.0 / 3.0, 1e-6);
}

TEST("outputs of the action taken are found and put back among those of all actions") {
  Network network = make_network(1, {}, 3, false, false, make_prediction(2, 0, 0.0, 0.0));
  std::vector<float> actions(kPanel, -1.0f);  // no action
  actions[kWidth + kLane] = 2.0f;
  const std::vector<float> outputs = panel_of({10.0f, 11.0f, 20.0f, 21.0f, 30.0f, 31.0f});
  std::vector<float> chosen(2 * kPanel), back(6 * kPanel);
  of_action(network, outputs.data(), actions.data(), chosen.data());
  CHECK_EQUAL(output(chosen, 0), 30.0f);
  CHECK_EQUAL(output(chosen, 1), 31.0f);
  to_action(network, chosen.data(), actions.data(), back.data());
  for (int i = 0; i < 6; ++i) {
    CHECK_EQUAL(output(back, i), i < 4 ? 0.0f : output(outputs, i));
    CHECK_EQUAL(back[static_cast<std::size_t>(i * kPanel)], 0.0f);  // a column without an action
  }
}

}  // namespace

int main() { return touchdown::check::run_all(); }
