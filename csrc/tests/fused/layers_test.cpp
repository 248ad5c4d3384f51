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

TEST("layer normalisation subtracts the mean, divides by the deviation, and ends in a ReLU") {
  // of 1 and 5: mean 3, σ = 2, so n = (−1, 1)
  std::vector<float> x = panel_of({1.0f, 5.0f}), normalized(2 * kPanel), inverse_sigma(kPanel);
  const float gain[] = {10.0f, 20.0f}, shift[] = {0.5f, 0.25f};
  layer_norm_relu_forward(gain, shift, 2, x.data(), normalized.data(), inverse_sigma.data());
  CHECK_NEAR(column(normalized, 0), -1.0, 1e-5);
  CHECK_NEAR(column(normalized, 1), 1.0, 1e-5);
  CHECK_NEAR(column(inverse_sigma, 0), 0.5, 1e-5);
  CHECK_EQUAL(column(x, 0), 0.0f);  // the ReLU of −9.5
  CHECK_NEAR(column(x, 1), 20.25, 1e-4);
}

TEST("the gradient through layer normalisation has no part along 1 or along n") {
  std::vector<float> x = panel_of({1.0f, 2.0f, 4.0f, 9.0f});
  std::vector<float> normalized(4 * kPanel), inverse_sigma(kPanel), grad(4 * kPanel);
  const float gain[] = {1.0f, 1.0f, 1.0f, 1.0f}, shift[] = {0.0f, 0.0f, 0.0f, 0.0f};
  layer_norm_relu_forward(gain, shift, 4, x.data(), normalized.data(), inverse_sigma.data());
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
  const Network network = make_network(1, {}, 2, false, true);
  std::vector<float> advantage = panel_of({4.0f, 0.0f}), value(kPanel);
  dueling_backward(network, advantage.data(), value.data());
  CHECK_EQUAL(column(value, 0), 4.0f);
  CHECK_EQUAL(column(advantage, 0), 2.0f);
  CHECK_EQUAL(column(advantage, 1), -2.0f);
}

TEST("a dueling head with several outputs per action adds each to its own value") {
  // V = (10, 20) and A(0) = (0, 1), A(1) = (4, 5), whatever s is
  const Network network = make_network(1, {}, 2, false, true, make_prediction(2, 0, 0.0, 0.0));
  const std::vector<float> params{0, 0, 10, 20, 0, 0, 0, 0, 0, 1, 4, 5};
  const std::vector<float> features = panel_of({1.0f});
  std::vector<float> state_value(2 * kPanel), outputs(4 * kPanel);
  head_forward(network, params.data(), features.data(), state_value.data(), outputs.data());
  CHECK_EQUAL(column(outputs, 0), 8.0f);  // 10 + 0 − 2
  CHECK_EQUAL(column(outputs, 1), 18.0f);
  CHECK_EQUAL(column(outputs, 2), 12.0f);
  CHECK_EQUAL(column(outputs, 3), 22.0f);
}

TEST("a product can go on from sums that are there") {
  const std::vector<float> a{2.0f, 3.0f};
  const std::vector<float> b = panel_of({10.0f, 100.0f});
  std::vector<float> out = panel_of({1.0f});
  multiply<Start::kSums>(a.data(), 2, 1, b.data(), 1, 2, nullptr, out.data());
  CHECK_EQUAL(column(out, 0), 321.0f);  // 1 + 2·10 + 3·100
}

// A panel's element, which is different for each panel, feature and sample.
float element(int panel, int feature, int sample) {
  return static_cast<float>((7 * panel + 3 * feature + sample) % 11 - 5);
}

std::vector<float> panels_of(int panels, int features) {
  std::vector<float> all;
  for (int p = 0; p < panels; ++p) {
    for (int f = 0; f < features; ++f) {
      for (int c = 0; c < kPanel; ++c) all.push_back(element(p, f, c));
    }
  }
  return all;
}

TEST("a panel becomes its samples, one behind the other") {
  const int features = kWidth + 3;
  const std::vector<float> panel = panels_of(1, features);
  const std::ptrdiff_t sample = padded(features);
  CHECK_EQUAL(sample, static_cast<std::ptrdiff_t>(2 * kWidth));
  std::vector<float> samples(static_cast<std::size_t>(kPanel * sample));
  to_samples(panel.data(), features, samples.data());
  for (int c = 0; c < kPanel; ++c) {
    for (int f = 0; f < features; ++f) {
      CHECK_EQUAL(samples[static_cast<std::size_t>(c * sample + f)], element(0, f, c));
    }
  }
}

TEST("a weight gradient is the sum of outer products over all panels, whatever its size") {
  for (const int rows : {1, kTileRows, 2 * kTileRows + 1}) {
    for (const int columns : {1, kWidth, 2 * kWidth + 3}) {
      const std::vector<float> grad = panels_of(2, rows), in = panels_of(2, columns);
      const std::ptrdiff_t sample = padded(columns);
      std::vector<float> samples(static_cast<std::size_t>(2 * kPanel * sample));
      for (int p = 0; p < 2; ++p) {
        to_samples(in.data() + p * columns * kPanel, columns, samples.data() + p * kPanel * sample);
      }
      const auto size = static_cast<std::size_t>(rows * columns);
      std::vector<float> out(size + kWidth + 1, -1.0f);
      sum_outer_products(grad.data(), static_cast<std::ptrdiff_t>(rows) * kPanel, rows,
                         samples.data(), columns, 2, out.data());
      CHECK_EQUAL(out[size + kWidth], -1.0f);  // it spills over no further
      for (int m = 0; m < rows; ++m) {
        for (int n = 0; n < columns; ++n) {
          float wanted = 0.0f;
          for (int p = 0; p < 2; ++p) {
            for (int c = 0; c < kPanel; ++c) wanted += element(p, m, c) * element(p, n, c);
          }
          CHECK_EQUAL(out[static_cast<std::size_t>(m * columns + n)], wanted);
        }
      }
    }
  }
}

TEST("a bias gradient is the sum over all samples") {
  const int rows = kWidth + 1;
  const std::vector<float> grad = panels_of(2, rows);
  std::vector<float> out(rows + 1, -1.0f);
  sum_samples(rows, 2, out.data(), [&](int panel, int f) {
    const float* const from = grad.data() + (panel * rows + f) * kPanel;
    return load(from) + load(from + kWidth);
  });
  for (int f = 0; f < rows; ++f) {
    float wanted = 0.0f;
    for (int p = 0; p < 2; ++p) {
      for (int c = 0; c < kPanel; ++c) wanted += element(p, f, c);
    }
    CHECK_EQUAL(out[static_cast<std::size_t>(f)], wanted);
  }
  CHECK_EQUAL(out[rows], -1.0f);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
