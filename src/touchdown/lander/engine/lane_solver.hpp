// The velocity iterations of many environments at once; which kernel does it is chosen at run time.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "rows.hpp"

namespace touchdown {

using VelocityRows = BasicVelocityRows<float>;

// In flight with both legs at their stops the iterations soon go round in circles, mostly of one, two
// or four: what they read and change is then the same, bit for bit, as so many iterations before. So
// it is looked at after two windows whose length is a multiple of those, and what has come round is
// done, but for the hinges' impulses, which no iteration reads: to them the last window's are added
// again until the end.
inline constexpr int kWindow = 12;
inline constexpr int kRounds = kVelocityIterations / kWindow - 2;
static_assert((kRounds + 2) * kWindow == kVelocityIterations);

inline bool may_circle(const VelocityRows& rows) {
  return rows.num_contacts == 0 && rows.joints[0].at_stop && rows.joints[1].at_stop;
}

// One instruction set's. Its functions take rows that have the same layout, which is the same bodies,
// numbers of points and stops, in the same order; at least one, and at most `lanes`.
struct Kernel {
  std::string_view name;
  std::size_t lanes;
  // Goes through so many iterations.
  void (*iterate)(std::span<VelocityRows* const> alike, int iterations);
  // Goes through two windows of rows that may circle. Says which of them have, and are done with all
  // iterations.
  void (*circle)(std::span<VelocityRows* const> alike, std::span<bool> done);
};

// The widest kernel that this processor runs, or the one that TOUCHDOWN_SIMD names.
// Throws std::invalid_argument if it names one that is unknown, or that does not run here.
const Kernel& kernel();

}  // namespace touchdown
