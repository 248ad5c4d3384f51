// The velocity iterations of many environments at once; which kernel does it is chosen at run time.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "rows.hpp"

namespace touchdown {

using VelocityRows = BasicVelocityRows<float>;

inline constexpr int kMostLaneContacts = 8;  // rows with more are so rare that they go one by one

// Solves rows that have the same layout: the same bodies, numbers of points and stops, in the same
// order. At least one, and at most as many as the kernel has lanes.
using SolveAlike = void (*)(std::span<VelocityRows* const> alike);

struct Kernel {
  std::string_view name;  // of the instruction set
  int lanes;              // environments solved at once
  SolveAlike solve;
};

// The widest kernel that this processor runs, or the one that TOUCHDOWN_SIMD names.
// Throws std::invalid_argument if it names one that is unknown, or that does not run here.
const Kernel& kernel();

}  // namespace touchdown
