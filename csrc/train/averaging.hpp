// The average of a network's weights over training (after Izmailov et al., 2018).
#pragma once

#include <cstddef>

namespace touchdown::train {

// average += rate·(online − average), each [num_params].
inline void add_to_average(float* average, const float* online, std::ptrdiff_t num_params,
                           double rate) {
  const auto share = static_cast<float>(rate);
  for (std::ptrdiff_t i = 0; i < num_params; ++i) average[i] += share * (online[i] - average[i]);
}

}  // namespace touchdown::train
