// Sine and cosine of a double, bit for bit as glibc (2.28 and later) computes them on a processor
// with fused multiply-add.
//
// The method is that of the IBM Accurate Mathematical Library: an angle of at most an eighth of a
// turn is split into a multiple of 1/128, whose sine and cosine are in a table with twice the
// precision, and a rest, for which short series do.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "web/libm/error_free.hpp"

namespace touchdown::web {
namespace table {

constexpr double kSteps = 128.0;  // per radian
constexpr std::size_t kSize = 128;

constexpr Twin sum_of(Twin a, Twin b) {
  const Twin sum = web::sum_of(a.high, b.high);
  return web::sum_of(sum.high, sum.low + a.low + b.low);
}
constexpr Twin product_of(Twin a, double b) {
  const Twin product = web::product_of(a.high, b);
  return web::sum_of(product.high, product.low + a.low * b);
}
constexpr Twin quotient_of(Twin a, double b) {
  const double quotient = a.high / b;
  const Twin product = web::product_of(quotient, b);
  return web::sum_of(quotient, (((a.high - product.high) - product.low) + a.low) / b);
}

struct Entry {
  Twin sine;
  Twin cosine;
};

// By their Taylor series.
constexpr Entry entry_at(double x) {
  Entry entry{};
  Twin term{1.0, 0.0};  // x^n / n!
  for (int n = 0; n < 28; ++n) {
    Twin& sum = n % 2 == 0 ? entry.cosine : entry.sine;
    sum = sum_of(sum, n % 4 < 2 ? term : Twin{-term.high, -term.low});
    term = quotient_of(product_of(term, x), n + 1);
  }
  return entry;
}

constexpr std::array<Entry, kSize> make() {
  std::array<Entry, kSize> entries{};
  for (std::size_t i = 0; i < kSize; ++i) {
    entries[i] = entry_at(static_cast<double>(i) / kSteps);
  }
  return entries;
}

inline constexpr std::array<Entry, kSize> kEntries = make();

}  // namespace table

namespace precise {

// An angle whose last digits are in `low`.
using Angle = Twin;

// The nearest multiple of 1/128 to an angle of at most an eighth of a turn, and what is left.
struct Split {
  const table::Entry& entry;
  double rest;
};
inline Split split(double x) {
  constexpr double rounding = 0x1.8p45;  // a sum with it has units of 1/128
  const double shifted = rounding + x;
  return {table::kEntries[std::bit_cast<std::uint64_t>(shifted) % table::kSize],
          x - (shifted - rounding)};
}

// (sin x - x)/x^3 and (1 - cos x)/x^2 for |x| ≤ 1/256, from x^2.
constexpr double sine_tail(double square) {
  return fused(square, 0x1.11110e829872fp-7, -0x1.5555555555515p-3);
}
constexpr double cosine_tail(double square) {
  return fused(square, fused(square, 0x1.6c16bedd9e239p-10, -0x1.5555555555535p-5), 0.5);
}

// The sine of an angle of at most an eighth of a turn or so.
inline double sine_of(Angle angle) {
  const double size = std::fabs(angle.high);
  if (size < 0.126) {
    const double x = angle.high, square = x * x;
    double sum = fused(-0x1.addffc2fcdf59p-26, square, 0x1.71de27b9a7ed9p-19);
    sum = fused(sum, square, -0x1.a01a019db08b8p-13);
    sum = fused(sum, square, 0x1.1111111110ecep-7);
    sum = fused(sum, square, -0x1.5555555555555p-3);
    return x + fused(fused(sum, x, -0.5 * angle.low), square, angle.low);
  }
  const double low = angle.high > 0.0 ? angle.low : -angle.low;
  const auto [at, rest] = split(size);
  const double square = rest * rest;
  const double sine = rest + fused(rest * square, sine_tail(square), low);
  const double versine = fused(rest, low, square * cosine_tail(square));
  double correction = fused(sine, at.cosine.low, at.sine.low);
  correction = fused(-at.sine.high, versine, correction);
  correction = fused(at.cosine.high, sine, correction);
  return std::copysign(at.sine.high + correction, angle.high);
}

inline double cosine_of(Angle angle) {
  const double low = angle.high < 0.0 ? -angle.low : angle.low;
  const auto [at, exact] = split(std::fabs(angle.high));
  const double rest = exact + low;
  const double square = rest * rest;
  const double sine = fused(rest * square, sine_tail(square), rest);
  const double versine = square * cosine_tail(square);
  double correction = fused(-sine, at.sine.low, at.cosine.low);
  correction = fused(-at.cosine.high, versine, correction);
  correction = fused(-at.sine.high, sine, correction);
  return at.cosine.high + correction;
}

constexpr double kQuarter = 0x1.921fb54442d18p0;       // π/2
constexpr double kQuarterLow = 0x1.1a62633145c07p-54;  // and its next digits

// The sine of any angle to which quarter turns have been added; beyond `limit`, which no lander
// reaches, it is not a number.
inline double sine_after(double x, unsigned quarters) {
  constexpr double limit = 105414350.0, rounding = 0x1.8p52;
  if (!(std::fabs(x) < limit)) return std::numeric_limits<double>::quiet_NaN();
  const double shifted = fused(x, 0x1.45f306dc9c883p-1, rounding);
  const double count = shifted - rounding;
  // π/2 in four parts, of which products with a count are subtracted one after the other.
  double rest = fused(-count, 0x1.921fb58p0, x);
  rest = fused(-count, -0x1.dde973cp-27, rest);
  const double high = fused(-count, -0x1.cb3b398p-55, rest);
  double low = fused(-count, -0x1.cb3b398p-55, rest - high);
  const double higher = fused(-count, -0x1.d747f23e32ed7p-83, high);
  low += fused(-count, -0x1.d747f23e32ed7p-83, high - higher);
  const auto number = static_cast<unsigned>(std::bit_cast<std::uint64_t>(shifted)) + quarters;
  const double value = number % 2 == 0 ? sine_of({higher, low}) : cosine_of({higher, low});
  return number % 4 < 2 ? value : -value;
}

constexpr std::uint32_t magnitude_bits(double x) {
  return static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(x) >> 32) & 0x7fffffffu;
}
constexpr std::uint32_t kEighth = 0x3feb6000;        // 0.8555
constexpr std::uint32_t kThreeEighths = 0x400368fd;  // 2.4263

}  // namespace precise

inline double sine(double x) {
  constexpr std::uint32_t tiny = 0x3e500000;  // 2^-26
  const std::uint32_t magnitude = precise::magnitude_bits(x);
  if (magnitude < tiny) return x;
  if (magnitude < precise::kEighth) return precise::sine_of({x, 0.0});
  if (magnitude < precise::kThreeEighths) {
    const double rest = precise::kQuarter - std::fabs(x);
    return std::copysign(precise::cosine_of({rest, precise::kQuarterLow}), x);
  }
  return precise::sine_after(x, 0);
}

inline double cosine(double x) {
  constexpr std::uint32_t tiny = 0x3e400000;  // 2^-27
  const std::uint32_t magnitude = precise::magnitude_bits(x);
  if (magnitude < tiny) return 1.0;
  if (magnitude < precise::kEighth) return precise::cosine_of({x, 0.0});
  if (magnitude < precise::kThreeEighths) {
    const double rest = precise::kQuarter - std::fabs(x);
    const double high = rest + precise::kQuarterLow;
    return precise::sine_of({high, (rest - high) + precise::kQuarterLow});
  }
  return precise::sine_after(x, 1);
}

}  // namespace touchdown::web
