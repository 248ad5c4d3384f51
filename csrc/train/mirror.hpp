// Mirror images of observations and actions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace touchdown::train {

// A symmetry of the environment, as touchdown.core.types.Mirror has it.
struct Mirror {
  std::vector<std::size_t> order;     // [D]
  std::vector<float> signs;           // [D]
  std::vector<std::int32_t> actions;  // [A]

  // Writes the image of an observation [D] to `image`, which must be apart from it.
  void reflect(const float* observation, float* image) const {
    for (std::size_t i = 0; i < order.size(); ++i) image[i] = observation[order[i]] * signs[i];
  }
};

}  // namespace touchdown::train
