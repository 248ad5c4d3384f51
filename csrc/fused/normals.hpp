// Normal numbers, a vector at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "fused/noise.hpp"
#include "fused/vector.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

typedef std::uint32_t Words __attribute__((vector_size(kWidth * 4), may_alias));

// The natural logarithm of normal numbers above 0, to about 1e-7.
//
// x = 2ⁿ·m with m from √½ to √2, and ln m = 2·artanh s with s = (m − 1) / (m + 1), |s| < 0.172.
inline Vector logarithm(Vector x) {
  constexpr int fraction_bits = 23, root_of_half = 0x3f3504f3;
  constexpr float ln2 = 0.693147181f;
  const IntVector bits = reinterpret_cast<IntVector>(x);
  const IntVector n = (bits - root_of_half) >> fraction_bits;
  const Vector m = reinterpret_cast<Vector>(bits - (n << fraction_bits));
  const Vector s = (m - 1.0f) / (m + 1.0f);
  const Vector square = s * s;
  Vector sum = broadcast(2.0f / 9.0f);
  sum = sum * square + 2.0f / 7.0f;
  sum = sum * square + 2.0f / 5.0f;
  sum = sum * square + 2.0f / 3.0f;
  sum = sum * square + 2.0f;
  return __builtin_convertvector(n, Vector) * ln2 + sum * s;
}

inline Vector polynomial(const std::array<float, 9>& coefficients, Vector at) {
  Vector sum{};
  for (const float coefficient : coefficients) sum = sum * at + coefficient;
  return sum;
}

// The inverse of the error function in single precision (M. Giles, "Approximating the erfinv
// function", 2011), which XLA uses too.
inline Vector inverse_erf(Vector x) {
  constexpr std::array central{2.81022636e-08f,  3.43273939e-07f, -3.5233877e-06f,
                               -4.39150654e-06f, 0.00021858087f,  -0.00125372503f,
                               -0.00417768164f,  0.246640727f,    1.50140941f};
  constexpr std::array tail{-0.000200214257f, 0.000100950558f, 0.00134934322f,
                            -0.00367342844f,  0.00573950773f,  -0.0076224613f,
                            0.00943887047f,   1.00167406f,     2.83297682f};
  const Vector w = -logarithm((1.0f - x) * (1.0f + x));
  const Vector in_the_middle = polynomial(central, w - 2.5f);
  const Vector far_out = polynomial(tail, square_root(w) - 3.0f);
  return (w < 5.0f ? in_the_middle : far_out) * x;
}

// f(ε) = sgn(ε)·√|ε| of the normal numbers that `jax.random.normal` draws as an array of `count`.
inline void scaled_normals(Key key, std::size_t count, float* scaled) {
  constexpr float least = -0x1.fffffep-1f;  // the float after −1
  constexpr float root_of_two = 1.41421356f;
  Words number;
  for (int lane = 0; lane < kWidth; ++lane) number[lane] = static_cast<std::uint32_t>(lane);
  for (std::size_t first = 0; first < count; first += kWidth, number += kWidth) {
    const auto [upper, lower] = threefry(key, Words{}, number);  // numbers are below 2³²
    // 23 random bits behind the exponent of 1 are a number from 1 to 2
    const Words mantissa = (upper ^ lower) >> 9 | 0x3f800000u;
    const Vector share = reinterpret_cast<Vector>(mantissa) - 1.0f;
    Vector x = share * (1.0f - least) + least;
    x = x < least ? broadcast(least) : x;
    const Vector normal = inverse_erf(x) * root_of_two;
    const Vector root = square_root(normal < 0.0f ? -normal : normal);
    const Vector found = normal < 0.0f ? -root : root;
    const std::size_t live = count - first < kWidth ? count - first : kWidth;
    std::memcpy(scaled + first, &found, live * sizeof(float));
  }
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
