// Hyperbolic tangent of a double, bit for bit as glibc (2.28 to 2.38) computes it on a processor
// with fused multiply-add.
//
// The method is that of Sun's FDLIBM: tanh x = (e^2x - 1)/(e^2x + 1), with e^y - 1 for y = k·ln 2 +
// r from a rational function of r.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "web/libm/error_free.hpp"

namespace touchdown::web {
namespace hyperbolic {

constexpr std::uint32_t magnitude_bits(double x) {
  return static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(x) >> 32) & 0x7fffffffu;
}

// x·2^k, exactly.
constexpr double scaled(double x, int k) {
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) +
                               (static_cast<std::uint64_t>(static_cast<std::int64_t>(k)) << 52));
}

// An exponent as a whole number of ln 2 and a rest, whose last digits are in `low`.
struct Reduced {
  int count;
  double rest;
  double low;
};

inline Reduced reduce(double x) {
  constexpr double ln2_high = 0x1.62e42feep-1, ln2_low = 0x1.a39ef35793c76p-33;
  constexpr std::uint32_t half_ln2 = 0x3fd62e42, more_than_ln2 = 0x3ff0a2b2;
  const std::uint32_t magnitude = magnitude_bits(x);
  if (magnitude <= half_ln2) return {0, x, 0.0};
  int count = x < 0.0 ? -1 : 1;
  if (magnitude >= more_than_ln2) {
    count = static_cast<int>(fused(0x1.71547652b82fep0, x, x < 0.0 ? -0.5 : 0.5));
  }
  const double high = fused(-count, ln2_high, x);
  const double low = count * ln2_low;
  const double rest = high - low;
  return {count, rest, (high - rest) - low};
}

// e^x - 1, for finite x from 2^-53 in magnitude up to 700.
inline double exponential_less_one(double x) {
  constexpr double q1 = -0x1.11111111110f4p-5, q2 = 0x1.a01a019fe5585p-10;
  constexpr double q3 = -0x1.4ce199eaadbb7p-14, q4 = 0x1.0cfca86e65239p-18;
  constexpr double q5 = -0x1.afdb76e09c32dp-23;
  const auto [count, rest, low] = reduce(x);
  const double half = 0.5 * rest;
  const double square = rest * half;
  const double fourth = square * square;
  const double series = fused(fourth * fourth, fused(square, q5, q4),
                              fused(fourth, fused(square, q3, q2), fused(square, q1, 1.0)));
  const double t = fused(-series, half, 3.0);
  const double ratio = square * ((series - t) / fused(-rest, t, 6.0));
  if (count == 0) return rest - fused(rest, ratio, -square);
  const double error = fused(rest, ratio - low, -low) - square;
  if (count == -1) return 0.5 * (rest - error) - 0.5;
  if (count == 1) {
    return rest < -0.25 ? -2.0 * (error - (rest + 0.5)) : 1.0 + 2.0 * (rest - error);
  }
  if (count <= -2 || count > 56) return scaled(1.0 - (error - rest), count) - 1.0;
  const double unit = scaled(1.0, -count);
  return count < 20 ? scaled((1.0 - unit) - (error - rest), count)
                    : scaled((rest - (error + unit)) + 1.0, count);
}

}  // namespace hyperbolic

inline double hyperbolic_tangent(double x) {
  constexpr double tiny = 0x1p-55, large = 22.0;
  const double size = std::fabs(x);
  if (!(size >= tiny)) return x * (1.0 + x);  // also what is not a number
  double value = 1.0;
  if (size < 1.0) {
    const double t = hyperbolic::exponential_less_one(-2.0 * size);
    value = -t / (t + 2.0);
  } else if (size < large) {
    const double t = hyperbolic::exponential_less_one(2.0 * size);
    value = 1.0 - 2.0 / (t + 2.0);
  }
  return std::copysign(value, x);
}

}  // namespace touchdown::web
