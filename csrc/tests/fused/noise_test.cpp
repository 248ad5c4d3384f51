// Noisy weights, compared with numbers from JAX and with plain loops.
#include "fused/noise.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "fused/kernel.hpp"
#include "fused/noisy.hpp"
#include "tests/check.hpp"
#include "tests/fused/slow_twin.hpp"

namespace {

using namespace touchdown::fused;

Network noisy_network(bool layer_norm, bool dueling, const Prediction& prediction = {}) {
  return make_network(3, std::vector<std::int64_t>{4, 2}, 2, layer_norm, dueling, prediction, true);
}

std::vector<float> sampled_by(const NetworkKernel& kernel, const Network& network,
                              const std::vector<float>& params, const float* noise) {
  std::vector<float> sampled(static_cast<std::size_t>(network.num_weights));
  kernel.sample_weights(network, params.data(), noise, sampled.data());
  return sampled;
}

TEST("keys follow from a key as in JAX") {
  const Key folded = derived({0, 7}, 1'000'001);
  CHECK_EQUAL(folded.first, 608322654u);
  CHECK_EQUAL(folded.second, 2762357916u);
  const Key third = derived({0, 7}, 2);
  CHECK_EQUAL(third.first, 966301609u);
  CHECK_EQUAL(third.second, 1948237315u);
}

// What a layer draws, by one instruction set.
std::vector<float> scaled_by(const NetworkKernel& kernel, Key key, std::size_t count) {
  std::vector<float> scaled(count);
  kernel.scaled_normals(key, count, scaled.data());
  return scaled;
}

double scaled(double normal) { return std::copysign(std::sqrt(std::fabs(normal)), normal); }

// The inverse of the error function, by Newton's method.
double inverse_erf(double y) {
  double x = 0.0;
  for (int i = 0; i < 200; ++i) {
    const double slope = 1.1283791670955126 * std::exp(-x * x);
    const double step = (std::erf(x) - y) / slope;
    x -= std::clamp(step, -0.5, 0.5);
  }
  return x;
}

TEST("normal numbers are those of JAX, in the middle and far out") {
  for (const auto set : touchdown::simd::kInstructionSets) {
    if (!touchdown::simd::is_available(set)) continue;
    const std::vector<float> found = scaled_by(kernel(set), {0, 7}, 103'010);
    CHECK_NEAR(found[0], scaled(0.45123515), 1e-6);
    CHECK_NEAR(found[1], scaled(1.95345092), 1e-6);
    CHECK_NEAR(found[96'183], scaled(4.43989277), 2e-6);
    CHECK_NEAR(found[103'009], scaled(-5.41998291), 2e-6);
  }
}

TEST("each of many normal numbers has the probability of its random bits") {
  for (const auto set : touchdown::simd::kInstructionSets) {
    if (!touchdown::simd::is_available(set)) continue;
    const Key key{3, 4};
    const std::vector<float> found = scaled_by(kernel(set), key, 20'000);
    for (std::size_t i = 0; i < found.size(); ++i) {
      const Key words = derived(key, i);
      const double share = ((words.first ^ words.second) >> 9) * 0x1p-23;
      const double right = scaled(std::sqrt(2.0) * inverse_erf(2.0 * share - 1.0 + 0x1p-24));
      // where the root is steep, a rounding of the 23 bits shows
      CHECK_NEAR(found[i], right, std::fabs(right) < 0.02 ? 1e-3 : 5e-6);
    }
  }
}

TEST("a few normal numbers are the first of many, and nothing is written beyond them") {
  for (const auto set : touchdown::simd::kInstructionSets) {
    if (!touchdown::simd::is_available(set)) continue;
    const std::vector<float> many = scaled_by(kernel(set), {1, 2}, 64);
    for (std::size_t count = 0; count < 40; ++count) {
      std::vector<float> few(64, -7.0f);
      kernel(set).scaled_normals({1, 2}, count, few.data());
      for (std::size_t i = 0; i < 64; ++i) CHECK_EQUAL(few[i], i < count ? many[i] : -7.0f);
    }
  }
}

TEST("samples differ by seed, purpose and number") {
  const NoiseSource source{.seed = 1, .purpose = 2, .number = 3};
  for (const NoiseSource& other : {NoiseSource{2, 2, 3}, {1, 3, 3}, {1, 2, 4}}) {
    CHECK(scaled_by(kernel(), source.key(), 1) != scaled_by(kernel(), other.key(), 1));
  }
}

TEST("the noise has an entry for each output and input of a linear layer") {
  // 4 + 3 and 2 + 4 of the hidden layers, 1 + 2 of the value, 2 + 2 of the advantages
  const Network network = noisy_network(true, true);
  CHECK_EQUAL(network.num_noise, 20);
  CHECK_EQUAL(network.num_weights, 16 + 8 + 10 + 4 + 3 + 6);
  CHECK_EQUAL(network.num_params, 2 * 16 + 8 + 2 * 10 + 4 + 2 * 3 + 2 * 6);
}

TEST("noisy weights are means plus σ times the noise of output and input") {
  // one layer with one input: weights 10 and 20, biases 1 and 2, their σ in the same order
  const Network network = make_network(1, {}, 2, false, false, {}, true);
  const std::vector<float> params{10, 20, 1, 2, 0.5f, 0.25f, 4, 8};
  const float noise[] = {2, -1, 3};  // of the outputs, then of the input
  for (const auto set : touchdown::simd::kInstructionSets) {
    if (!touchdown::simd::is_available(set)) continue;
    const std::vector<float> sampled = sampled_by(kernel(set), network, params, noise);
    CHECK_EQUAL(sampled[0], 13.0f);   // 10 + ½·2·3
    CHECK_EQUAL(sampled[1], 19.25f);  // 20 − ¼·1·3
    CHECK_EQUAL(sampled[2], 9.0f);    // 1 + 4·2
    CHECK_EQUAL(sampled[3], -6.0f);   // 2 − 8·1
    const std::vector<float> means = sampled_by(kernel(set), network, params, nullptr);
    CHECK_EQUAL(means[0], 10.0f);
    CHECK_EQUAL(means[3], 2.0f);
  }
}

TEST("σ has the gradient of its sampled weight times the noise, and a norm has its own") {
  const Network network = noisy_network(true, true, make_prediction(2, 0, 0.0, 0.0));
  const std::vector<float> params = random_params(network, 1);
  std::vector<float> noise(static_cast<std::size_t>(network.num_noise));
  draw_noise(network, {0, 7}, noise);
  std::vector<float> along = random_params(network, 2);  // a gradient of the sampled weights
  along.resize(static_cast<std::size_t>(network.num_weights));
  std::vector<float> gradient(params.size());
  baseline::noisy_gradient(network, along.data(), noise.data(), gradient.data());
  // sampled weights are linear in what is learned, so a difference is a derivative
  for (std::size_t p = 0; p < params.size(); ++p) {
    std::vector<float> moved = params;
    moved[p] += 1.0f;
    const std::vector<float> before = sampled_by(kernel(), network, params, noise.data());
    const std::vector<float> after = sampled_by(kernel(), network, moved, noise.data());
    double slope = 0.0;
    for (std::size_t i = 0; i < along.size(); ++i) slope += along[i] * (after[i] - before[i]);
    CHECK_NEAR(gradient[p], slope, 1e-5);
  }
}

}  // namespace

int main() { return touchdown::check::run_all(); }
