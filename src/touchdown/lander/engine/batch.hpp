// Many landers stepped together: everything scalar, save the velocity iterations, which go in lanes.
#pragma once

#include <cstddef>
#include <span>

#include "lander.hpp"

namespace touchdown {

// Where a batch's results go: one row an environment, each written in place.
struct Results {
  float* observations;  // [N, 8]
  double* rewards;      // [N]
  bool* terminated;     // [N]
};

// Steps landers one after the other in blocks, sorting each block's rows by their layout, so that
// what is solved side by side is alike. `throttles` has one entry a lander; `active` says which of
// them to step. Results do not depend on who else is in the batch.
void step(std::span<Lander> landers, std::span<const Throttle> throttles,
          std::span<const unsigned char> active, const Results& results);

}  // namespace touchdown
