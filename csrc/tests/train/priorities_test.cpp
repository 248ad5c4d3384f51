// Sampling by priority; tests/training/test_compiled.py compares it with Python's.
#include "train/priorities.hpp"

#include <array>
#include <cstdint>
#include <vector>

#include "tests/check.hpp"

namespace touchdown::train {
namespace {

struct Tree {
  explicit Tree(const std::vector<double>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) tree().set(static_cast<int>(i), values[i]);
  }
  SumTree tree() { return {.nodes = nodes.data(), .first_leaf = 8}; }

  std::array<double, 16> nodes{};
};

TEST("every inner node of the tree is the sum of its children") {
  Tree tree({3.0, 0.0, 1.0, 4.0, 2.0});
  CHECK_EQUAL(tree.tree().total(), 10.0);
  tree.tree().set(3, 0.5);
  CHECK_EQUAL(tree.tree().total(), 6.5);
  for (std::size_t node = 1; node < 8; ++node) {
    CHECK_EQUAL(tree.nodes[node], tree.nodes[2 * node] + tree.nodes[2 * node + 1]);
  }
}

TEST("a sum leads to the number at which the cumulative sum exceeds it") {
  const std::vector<double> values{3.0, 0.0, 1.0, 4.0, 2.0};
  Tree tree(values);
  for (double sum = 0.0; sum < 10.0; sum += 0.25) {
    std::int64_t index = 0;
    for (double cumulative = values[0]; cumulative <= sum; ++index) {
      cumulative += values[static_cast<std::size_t>(index) + 1];
    }
    CHECK_EQUAL(tree.tree().find(sum), index);
  }
  CHECK_EQUAL(tree.tree().find(10.0), 4);  // as rounding may ask for
}

TEST("weights make up for the priorities, and errors become priorities") {
  Tree tree({1.0, 1.0, 2.0});
  const BitGenerator halves{.next_double = [](void*) { return 0.5; }};
  const PrioritySettings settings{.alpha = 0.5, .beta = 1.0, .beta_duration = 1};
  PriorityCounts counts;
  std::array<std::int64_t, 2> order{};
  std::array<float, 2> weights{};
  std::array<double, 2> scratch{};
  draw_by_priority(settings, tree.tree(), 3, halves, order, weights, scratch, counts);
  // sums of 1 and 3
  CHECK_EQUAL(order[0], 1);
  CHECK_EQUAL(order[1], 2);
  CHECK_EQUAL(weights[0], 1.0f);
  CHECK_EQUAL(weights[1], 0.5f);
  CHECK_EQUAL(counts.num_batches, 1.0);
  order = {0, 1};
  const std::array<float, 2> errors{-4.0f, 9.0f};
  update_priorities(settings, tree.tree(), order, errors, scratch, counts);
  CHECK_NEAR(tree.tree().value(0), 2.0, 1e-6);
  CHECK_NEAR(tree.tree().value(1), 3.0, 1e-6);
  CHECK_NEAR(counts.max_priority, 3.0, 1e-6);
}

}  // namespace
}  // namespace touchdown::train

int main() { return touchdown::check::run_all(); }
