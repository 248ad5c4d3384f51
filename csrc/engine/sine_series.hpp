// The polynomials and the reduction by which glibc (2.28 and later) computes sines and cosines of
// floats, in double precision. `Double` is a double or a vector of doubles.
#pragma once

namespace touchdown::engine {

// Multiplications and additions that are each rounded.
struct PlainArithmetic {
  template <typename A, typename B, typename C>
  static constexpr auto sum(A a, B b, C c) {
    return a * b + c;
  }
};

// The sine of an angle of at most an eighth of a turn, in radians.
template <typename Arithmetic, typename Double>
constexpr Double sine_series(Double x) {
  constexpr double c3 = -0x1.555545995a603p-3, c5 = 0x1.1107605230bc4p-7;
  constexpr double c7 = -0x1.994eb3774cf24p-13;
  const Double square = x * x;
  const Double cube = square * x;
  return Arithmetic::sum(cube * square, Arithmetic::sum(square, c7, c5),
                         Arithmetic::sum(cube, c3, x));
}

// The cosine of such an angle.
template <typename Arithmetic, typename Double>
constexpr Double cosine_series(Double x) {
  constexpr double c2 = -0x1.ffffffd0c621cp-2, c4 = 0x1.55553e1068f19p-5;
  constexpr double c6 = -0x1.6c087e89a359dp-10, c8 = 0x1.99343027bf8c3p-16;
  const Double square = x * x;
  const Double fourth = square * square;
  return Arithmetic::sum(square * fourth, Arithmetic::sum(square, c8, c6),
                         Arithmetic::sum(fourth, c4, Arithmetic::sum(square, c2, 1.0)));
}

// Angles below this one are reduced with a quarter turn of 53 bits. Its product with a count of
// quarter turns is subtracted in two parts, both exact, so that there is only one rounding.
inline constexpr float kSmallAngle = 120.0f;
inline constexpr double kQuarterHigh = 0x1.921fb5444p0, kQuarterLow = 0x1.68cp-39;
static_assert(kQuarterHigh + kQuarterLow == 0x1.921fb54442d18p0);
inline constexpr double kEighthOfTurn = (kQuarterHigh + kQuarterLow) / 2;
// The count is rounded to a whole number by way of a fixed-point number with so many binary places.
inline constexpr int kCountPlaces = 24;
inline constexpr double kQuartersPerRadian = 0x1.45f306dc9c883p-1 * (1 << kCountPlaces);

// Below this angle, a sine is the angle, and a cosine is 1.
inline constexpr float kTinyAngle = 0x1p-12f;

// How far a series can be off, as a share, if its operations are fused or not.
inline constexpr double kSeriesSlack = 0x1p-49;

}  // namespace touchdown::engine
