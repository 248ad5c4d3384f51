// Arithmetic that keeps its rounding errors, and the fused multiply-add that follows from it.
//
// Sources: T. J. Dekker, "A floating-point technique for extending the available precision", 1971;
// S. Boldo and G. Melquiond, "Emulation of FMA and correctly rounded sums: proved algorithms using
// rounding to odd", 2008.
#pragma once

#include <bit>
#include <cstdint>

namespace touchdown::web {

// The unevaluated sum of two doubles; `low` is at most half a unit in the last place of `high`.
struct Twin {
  double high;
  double low;
};

constexpr Twin sum_of(double a, double b) {
  const double sum = a + b;
  const double from_b = sum - a;
  return {sum, (a - (sum - from_b)) + (b - from_b)};
}

constexpr Twin halves_of(double a) {
  const double shifted = 0x1.0000002p27 * a;
  const double high = shifted - (shifted - a);
  return {high, a - high};
}

constexpr Twin product_of(double a, double b) {
  const double product = a * b;
  const Twin x = halves_of(a), y = halves_of(b);
  return {product, ((x.high * y.high - product) + x.high * y.low + x.low * y.high) + x.low * y.low};
}

// The sum, rounded to the neighbour whose last bit is odd unless it is a double.
constexpr double odd_sum_of(double a, double b) {
  const Twin sum = sum_of(a, b);
  const auto bits = std::bit_cast<std::uint64_t>(sum.high);
  if (sum.low == 0.0 || (bits & 1) != 0) return sum.high;
  return std::bit_cast<double>((sum.low > 0.0) == (sum.high > 0.0) ? bits + 1 : bits - 1);
}

// a·b + c, rounded once; WebAssembly has no such instruction. Products must be far from overflow
// and underflow.
constexpr double fused(double a, double b, double c) {
  const Twin product = product_of(a, b);
  const Twin low = sum_of(c, product.low);
  const Twin high = sum_of(product.high, low.high);
  return high.high + odd_sum_of(low.low, high.low);
}

}  // namespace touchdown::web
