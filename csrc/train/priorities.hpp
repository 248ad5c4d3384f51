// Prioritised replay, proportional variant (Schaul et al., 2016): a sum tree in Python's memory.
//
// The Python twins are touchdown.replay.priorities and touchdown.replay.sum_tree; both compute in
// double precision, with the same operations in the same order.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "train/draws.hpp"

namespace touchdown::train {

// A full binary tree whose leaves are the priorities; every inner node is the sum of its children.
// Node i is the parent of 2i and 2i + 1; node 1 is the root.
struct SumTree {
  double* nodes;           // [2·first_leaf]
  std::size_t first_leaf;  // a power of 2, not less than the number of priorities

  double total() const { return nodes[1]; }
  double value(std::int64_t index) const { return nodes[place_of(index)]; }

  void set(std::int64_t index, double value) const {
    std::size_t place = place_of(index);
    nodes[place] = value;
    while (place > 1) {
      place >>= 1;
      nodes[place] = nodes[2 * place] + nodes[2 * place + 1];
    }
  }

  // The index at which the cumulative sum first exceeds `sum`, from 0 to below `total()`.
  std::int64_t find(double sum) const {
    std::size_t place = 1;
    while (place < first_leaf) {
      place *= 2;
      const double left = nodes[place];
      // Rounding must not lead into a right half that is empty.
      if (!(sum >= left) || !(nodes[place + 1] > 0.0)) continue;
      sum -= left;
      ++place;
    }
    return static_cast<std::int64_t>(place - first_leaf);
  }

 private:
  std::size_t place_of(std::int64_t index) const {
    return first_leaf + static_cast<std::size_t>(index);
  }
};

// Exponents, with the names of touchdown.config.sections.
struct PrioritySettings {
  double alpha = 0.0;
  double beta = 1.0;
  std::int64_t beta_duration = 1;  // minibatches
};

// What changes and is no array.
struct PriorityCounts {
  double max_priority = 1.0;  // of the transitions that were never sampled
  double num_batches = 0.0;
};

// The largest number; NaN if one is NaN, as in NumPy.
inline double largest_of(std::span<const double> numbers) {
  double largest = numbers.front();
  for (const double number : numbers) {
    if (std::isnan(largest)) break;
    if (!(number <= largest)) largest = number;
  }
  return largest;
}

// Draws a minibatch, one transition from each of B equal parts of the total priority, and its
// importance-sampling weights, normalised to a maximum of 1.
inline void draw_by_priority(const PrioritySettings& settings, const SumTree& tree,
                             std::int64_t num_held, const BitGenerator& rng,
                             std::span<std::int64_t> order, std::span<float> weights,
                             std::span<double> scratch, PriorityCounts& counts) {
  const std::size_t batch_size = order.size();
  const double total = tree.total();
  const double part = total / static_cast<double>(batch_size);
  for (std::size_t i = 0; i < batch_size; ++i) {
    order[i] = tree.find((static_cast<double>(i) + draw_uniform(rng)) * part);
  }
  const double beta =
      std::min(1.0, settings.beta + (1.0 - settings.beta) * counts.num_batches /
                                        static_cast<double>(settings.beta_duration));
  ++counts.num_batches;
  for (std::size_t i = 0; i < batch_size; ++i) {
    scratch[i] = std::pow(static_cast<double>(num_held) * tree.value(order[i]) / total, -beta);
  }
  const double largest = largest_of(scratch.first(batch_size));
  for (std::size_t i = 0; i < batch_size; ++i) {
    weights[i] = static_cast<float>(scratch[i] / largest);
  }
}

// Priorities of a minibatch from its TD errors: pᵢ = (|δᵢ| + ε)^α.
inline void update_priorities(const PrioritySettings& settings, const SumTree& tree,
                              std::span<const std::int64_t> order, std::span<const float> td_error,
                              std::span<double> scratch, PriorityCounts& counts) {
  constexpr double smallest = 1e-6;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const double error = std::abs(static_cast<double>(td_error[i])) + smallest;
    scratch[i] = std::pow(error, settings.alpha);
    tree.set(order[i], scratch[i]);
  }
  counts.max_priority = std::max(counts.max_priority, largest_of(scratch.first(order.size())));
}

}  // namespace touchdown::train
