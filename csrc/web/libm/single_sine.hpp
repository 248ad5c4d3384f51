// Sine and cosine of a float, bit for bit as glibc (2.28 and later) computes them on a processor
// with fused multiply-add.
//
// glibc reduces the angle and evaluates a polynomial in double precision, and rounds the result to
// a float. What that takes is the same reduction, the same coefficients, and the same roundings
// wherever they can be seen in the float.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "engine/sine_series.hpp"
#include "web/libm/error_free.hpp"

namespace touchdown::web {

// An angle as a whole number of quarter turns and a rest of at most an eighth of a turn.
struct QuarterTurns {
  unsigned count;  // modulo 4
  double rest;     // radians
};

namespace single {

// Multiplications and additions of which each pair is rounded once.
struct FusedArithmetic {
  static constexpr double sum(double a, double b, double c) { return fused(a, b, c); }
};

template <typename Arithmetic>
constexpr double series(QuarterTurns angle) {
  const double value = angle.count % 2 == 0 ? engine::sine_series<Arithmetic>(angle.rest)
                                            : engine::cosine_series<Arithmetic>(angle.rest);
  return angle.count % 4 < 2 ? value : -value;
}

constexpr std::uint32_t magnitude_bits(float x) {
  return std::bit_cast<std::uint32_t>(x) & 0x7fffffffu;
}

// For angles below 120.
constexpr QuarterTurns reduce_small(float x) {
  const auto fixed = static_cast<std::int32_t>(x * engine::kQuartersPerRadian);
  const std::int32_t count = (fixed + (1 << (engine::kCountPlaces - 1))) >> engine::kCountPlaces;
  return {static_cast<unsigned>(count),
          (x - count * engine::kQuarterHigh) - count * engine::kQuarterLow};
}

// For all finite angles from 120 on: the float's 24 bits times the 96 bits of 2/π, in units of a
// quarter turn, that matter for it.
constexpr QuarterTurns reduce_large(float x) {
  // The binary places of 2/π as bytes, after three bytes of zeros.
  constexpr std::array<std::uint8_t, 28> digits{
      0,    0,    0,    0xa2, 0xf9, 0x83, 0x6e, 0x4e, 0x44, 0x15, 0x29, 0xfc, 0x27, 0x57,
      0xd1, 0xf5, 0x34, 0xdd, 0xc0, 0xdb, 0x62, 0x95, 0x99, 0x3c, 0x43, 0x90, 0x41, 0xfe};
  __extension__ using Wide = unsigned __int128;
  const std::uint32_t bits = magnitude_bits(x);
  const std::uint32_t exponent = bits >> 23;
  const std::size_t first = exponent / 8 % 16;
  Wide window = 0;
  for (std::size_t i = first; i < first + 12; ++i) window = window << 8 | digits[i];
  const std::uint64_t mantissa = std::uint64_t{(bits & 0x7fffffu) | 0x800000u} << exponent % 8;
  // Two bits of whole quarter turns, modulo 4, then 62 binary places.
  const auto turns = static_cast<std::uint64_t>(window * mantissa >> 32);
  const std::uint64_t count = (turns + (std::uint64_t{1} << 61)) >> 62;
  const auto places = static_cast<std::int64_t>(turns - (count << 62));
  const double rest = static_cast<double>(places) * 0x1.921fb54442d18p-62;
  const auto quarters = static_cast<unsigned>(count);
  return x < 0.0f ? QuarterTurns{0u - quarters, -rest} : QuarterTurns{quarters, rest};
}

// The sine of an angle to which quarter turns have been added.
constexpr float sine_after(float x, unsigned quarters) {
  constexpr std::uint32_t below_an_eighth_turn = std::bit_cast<std::uint32_t>(0.75f),
                          limit = std::bit_cast<std::uint32_t>(engine::kSmallAngle);
  const std::uint32_t magnitude = magnitude_bits(x);
  QuarterTurns angle = magnitude < below_an_eighth_turn ? QuarterTurns{0, x}
                       : magnitude < limit              ? reduce_small(x)
                                                        : reduce_large(x);
  angle.count += quarters;
  // Both series differ by a few units in the last place of a double, which a float seldom shows.
  const double plain = series<engine::PlainArithmetic>(angle);
  const double slack = plain * engine::kSeriesSlack;
  const auto rounded = static_cast<float>(plain - slack);
  if (rounded == static_cast<float>(plain + slack)) return rounded;
  return static_cast<float>(series<FusedArithmetic>(angle));
}

constexpr std::uint32_t kTiny = std::bit_cast<std::uint32_t>(engine::kTinyAngle);
constexpr std::uint32_t kInfinity = 0x7f800000;

}  // namespace single

constexpr float sine(float x) {
  const std::uint32_t magnitude = single::magnitude_bits(x);
  if (magnitude < single::kTiny) return x;
  if (magnitude >= single::kInfinity) return x - x;
  return single::sine_after(x, 0);
}

constexpr float cosine(float x) {
  const std::uint32_t magnitude = single::magnitude_bits(x);
  if (magnitude < single::kTiny) return 1.0f;
  if (magnitude >= single::kInfinity) return x - x;
  return single::sine_after(x, 1);
}

}  // namespace touchdown::web
