// Single layers of the baseline kernel. Its panels have kPanel samples; one column is checked, and
// the others hold decoys.
#include "fused/layers.hpp"

#include <cmath>
#include <vector>

#include "tests/check.hpp"

namespace {

using namespace touchdown::fused;
using namespace touchdown::fused::baseline;

constexpr int kColumn = kWidth + 1;  // in the second vector of the panel

// A panel with these features in one column, and decoys in the others.
std::vector<float> panel_of(const std::vector<float>& features) {
  std::vector<float> panel;
  for (const float feature : features) {
    for (int c = 0; c < kPanel; ++c) {
      panel.push_back(c == kColumn ? feature : 100.0f + static_cast<float>(c) * feature);
    }
  }
  return panel;
}

float column(const std::vector<float>& panel, int feature) {
  return panel[static_cast<std::size_t>(feature * kPanel + kColumn)];
}

TEST("a linear layer is weight times input plus bias") {
  const Linear linear{.in = 2, .out = 3, .weight = 1, .bias = 7};
  const std::vector<float> params{-9, /* weight */ 1, 2, 3, 4, 5, 6, /* bias */ 10, 20, 30};
  const std::vector<float> in = panel_of({1.0f, -1.0f});
  std::vector<float> out(3 * kPanel);
  linear_forward(linear, params.data(), in.data(), out.data());
  CHECK_EQUAL(column(out, 0), 9.0f);   // 1 − 2 + 10
  CHECK_EQUAL(column(out, 1), 19.0f);  // 3 − 4 + 20
  CHECK_EQUAL(column(out, 2), 29.0f);  // 5 − 6 + 30
}

TEST("ReLU keeps what is positive, and NaN") {
  std::vector<float> x = panel_of({2.0f, -2.0f, NAN});
  relu(x.data(), 3);
  CHECK_EQUAL(column(x, 0), 2.0f);
  CHECK_EQUAL(column(x, 1), 0.0f);
  CHECK(std::isnan(column(x, 2)));
}

TEST("layer normalisation subtracts the mean of the features and divides by their deviation") {
  // of 1 and 5: mean 3, σ = 2, so n = (−1, 1)
  std::vector<float> x = panel_of({1.0f, 5.0f}), normalized(2 * kPanel), inverse_sigma(kPanel);
  const float gain[] = {10.0f, 20.0f}, shift[] = {0.5f, 0.25f};
  layer_norm_forward(gain, shift, 2, x.data(), normalized.data(), inverse_sigma.data());
  CHECK_NEAR(column(normalized, 0), -1.0, 1e-5);
  CHECK_NEAR(column(normalized, 1), 1.0, 1e-5);
  CHECK_NEAR(column(inverse_sigma, 0), 0.5, 1e-5);
  CHECK_NEAR(column(x, 0), -9.5, 1e-4);
  CHECK_NEAR(column(x, 1), 20.25, 1e-4);
}

TEST("the gradient through layer normalisation has no part along 1 or along n") {
  std::vector<float> x = panel_of({1.0f, 2.0f, 4.0f, 9.0f});
  std::vector<float> normalized(4 * kPanel), inverse_sigma(kPanel), grad(4 * kPanel);
  const float gain[] = {1.0f, 1.0f, 1.0f, 1.0f}, shift[] = {0.0f, 0.0f, 0.0f, 0.0f};
  layer_norm_forward(gain, shift, 4, x.data(), normalized.data(), inverse_sigma.data());
  const std::vector<float> norm_grad = panel_of({1.0f, -2.0f, 0.5f, 3.0f});
  layer_norm_backward(gain, 4, norm_grad.data(), normalized.data(), inverse_sigma.data(),
                      grad.data());
  float sum = 0.0f, along = 0.0f;
  for (int f = 0; f < 4; ++f) {
    sum += column(grad, f);
    along += column(grad, f) * column(normalized, f);
  }
  CHECK_NEAR(sum, 0.0, 1e-5);
  CHECK_NEAR(along, 0.0, 1e-5);
}

TEST("a dueling head adds the value and subtracts the mean advantage") {
  // V = 2·s and A = (1, 3)·s: of s = 1, Q = (2 + 1 − 2, 2 + 3 − 2)
  Network network;
  network.num_actions = 2;
  network.dueling = true;
  network.value = {.in = 1, .out = 1, .weight = 0, .bias = 1};
  network.advantage = {.in = 1, .out = 2, .weight = 2, .bias = 4};
  const std::vector<float> params{2, 0, 1, 3, 0, 0};
  const std::vector<float> features = panel_of({1.0f});
  std::vector<float> state_value(kPanel), q(2 * kPanel);
  head_forward(network, params.data(), features.data(), state_value.data(), q.data());
  CHECK_EQUAL(column(q, 0), 1.0f);
  CHECK_EQUAL(column(q, 1), 3.0f);
}

TEST("a dueling head's gradient goes whole to the value and without its mean to the advantages") {
  std::vector<float> advantage = panel_of({4.0f, 0.0f}), value(kPanel);
  dueling_backward(2, advantage.data(), value.data());
  CHECK_EQUAL(column(value, 0), 4.0f);
  CHECK_EQUAL(column(advantage, 0), 2.0f);
  CHECK_EQUAL(column(advantage, 1), -2.0f);
}

TEST("a weight gradient is the sum of outer products over all panels") {
  // two panels of ones: each entry counts the samples
  const std::vector<float> ones(2 * 3 * kPanel, 1.0f);
  std::vector<float> out(9);
  sum_outer_products(ones.data(), 3 * kPanel, 3, ones.data(), 3 * kPanel, 3, 2, out.data());
  for (const float entry : out) CHECK_EQUAL(entry, 2.0f * kPanel);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
