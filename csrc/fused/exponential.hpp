// eˣ of a vector.
#pragma once

#include "fused/vector.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

// eˣ for x ≤ 0, to about one unit in the last place; below e⁻⁸⁷ it stays there. NaN stays NaN.
//
// x = n·ln 2 + r with a whole n and |r| ≤ ½·ln 2: eˣ = 2ⁿ·eʳ, with eʳ from its Taylor series.
inline Vector exponential(Vector x) {
  constexpr float log2_e = 1.44269504f;
  // ln 2 in two parts: n times the first one, which has few digits, is exact.
  constexpr float ln2_high = 0.693359375f, ln2_low = -2.12194440e-4f;
  // Adding it rounds to a whole number, which then is in the last bits of the sum.
  constexpr float shifter = 12582912.0f;  // 1.5·2²³
  x = x < -87.0f ? broadcast(-87.0f) : x;
  const Vector shifted = x * log2_e + shifter;
  const Vector n = shifted - shifter;
  const Vector r = (x - n * ln2_high) - n * ln2_low;
  Vector sum = broadcast(1.0f / 5040.0f);
  sum = sum * r + 1.0f / 720.0f;
  sum = sum * r + 1.0f / 120.0f;
  sum = sum * r + 1.0f / 24.0f;
  sum = sum * r + 1.0f / 6.0f;
  sum = sum * r + 0.5f;
  sum = sum * r + 1.0f;
  sum = sum * r + 1.0f;
  constexpr int fraction_bits = 23;
  return reinterpret_cast<Vector>((reinterpret_cast<IntVector>(shifted) << fraction_bits) +
                                  reinterpret_cast<IntVector>(sum));
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
