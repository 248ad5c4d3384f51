#include <iostream>

#include "fused/kernel.hpp"
#include "tests/check.hpp"
#include "tests/fused/slow_twin.hpp"

namespace {

using namespace touchdown::fused;
namespace simd = touchdown::simd;

std::vector<float> values_of(const NetworkKernel& kernel, const Network& network,
                             const std::vector<float>& params,
                             const std::vector<float>& observations) {
  const std::size_t count =
      observations.size() / static_cast<std::size_t>(network.num_observations);
  std::vector<float> q(count * static_cast<std::size_t>(network.num_actions));
  std::vector<float> workspace(kernel.values_workspace(network));
  kernel.values(network, params.data(), observations.data(), static_cast<std::ptrdiff_t>(count),
                workspace.data(), q.data());
  return q;
}

TEST("values are those of plain loops, under each instruction set") {
  constexpr std::size_t count = 37;
  for (const simd::InstructionSet set : simd::kInstructionSets) {
    if (!simd::is_available(set)) continue;
    for (const auto& [name, network] : networks()) {
      std::cerr << simd::name(set) << ", " << name << '\n';
      const std::vector<float> params = random_params(network, 1);
      const RandomBatch batch(network, count, 2);
      const std::vector<float> q = values_of(kernel(set), network, params, batch.o_t);
      for (std::size_t i = 0; i < count; ++i) {
        const Doubles expected = slow_values(network, {params.begin(), params.end()},
                                             observation_of(batch.o_t, network, i));
        for (std::size_t a = 0; a < expected.size(); ++a) {
          CHECK_NEAR(q[i * expected.size() + a], expected[a], 1e-4);
        }
      }
    }
  }
}

TEST("a value does not depend on the observations beside it, nor on how many there are") {
  constexpr std::size_t count = 37;
  for (const simd::InstructionSet set : simd::kInstructionSets) {
    if (!simd::is_available(set)) continue;
    for (const auto& [name, network] : networks()) {
      std::cerr << simd::name(set) << ", " << name << '\n';
      const std::vector<float> params = random_params(network, 1);
      const RandomBatch batch(network, count, 2);
      const std::vector<float> together = values_of(kernel(set), network, params, batch.o_t);
      for (const std::size_t few : {1, 2, 3, 7}) {
        for (std::size_t first = 0; first + few <= count; first += few) {
          std::vector<float> observations;
          for (std::size_t i = first; i < first + few; ++i) {
            for (const double each : observation_of(batch.o_t, network, i)) {
              observations.push_back(static_cast<float>(each));
            }
          }
          const std::vector<float> q = values_of(kernel(set), network, params, observations);
          for (std::size_t i = 0; i < q.size(); ++i) CHECK_EQUAL(q[i], together[3 * first + i]);
        }
      }
    }
  }
}

}  // namespace

int main() { return touchdown::check::run_all(); }
