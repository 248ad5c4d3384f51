// Vectors of the kernel's instruction set.
#pragma once

#include <cmath>
#include <cstring>
#include <utility>

#include "simd/kernel_target.hpp"

#if defined(_MSC_VER)
#error "GCC or Clang is needed, for their vector types"
#endif

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

constexpr int kWidth = TOUCHDOWN_WIDTH;  // floats in a vector

typedef float Vector __attribute__((vector_size(kWidth * 4), may_alias));
typedef int IntVector __attribute__((vector_size(kWidth * 4), may_alias));

inline Vector load(const float* from) {
  Vector vector;
  std::memcpy(&vector, from, sizeof vector);
  return vector;
}

inline void store(float* to, Vector vector) { std::memcpy(to, &vector, sizeof vector); }

// Subtracting 0 leaves every value as it is, even the sign of a zero, and compilers know it.
inline Vector broadcast(float value) { return value - Vector{}; }

// Two vectors' elements chosen by number; the second one's begin at kWidth.
template <int... kIndices>
inline Vector chosen(Vector a, Vector b, std::integer_sequence<int, kIndices...>) {
#if defined(__clang__) || __GNUC__ >= 12
  return __builtin_shufflevector(a, b, kIndices...);
#else
  typedef int Indices __attribute__((vector_size(kWidth * 4)));
  return __builtin_shuffle(a, b, Indices{kIndices...});
#endif
}

// Element i of the result is element i of `a` if i has the bit, of `b`, kBit before it, otherwise.
template <int kBit, bool kUpper, int... kLanes>
inline Vector exchanged(Vector a, Vector b, std::integer_sequence<int, kLanes...>) {
  return chosen(a, b,
                std::integer_sequence<int, ((kLanes & kBit) ? kLanes + kWidth - (kUpper ? 0 : kBit)
                                                            : kLanes + (kUpper ? kBit : 0))...>{});
}

// Transposes a square of kWidth vectors in place, exchanging blocks of kBit, kBit / 2, ...
// elements.
template <int kBit = kWidth / 2>
inline void transpose(Vector* rows) {
  constexpr auto lanes = std::make_integer_sequence<int, kWidth>{};
  for (int i = 0; i < kWidth; ++i) {
    if (i & kBit) continue;
    const Vector a = rows[i], b = rows[i + kBit];
    rows[i] = exchanged<kBit, false>(a, b, lanes);
    rows[i + kBit] = exchanged<kBit, true>(a, b, lanes);
  }
  if constexpr (kBit > 1) transpose<kBit / 2>(rows);
}

inline Vector square_root(Vector x) {
  for (int lane = 0; lane < kWidth; ++lane) x[lane] = std::sqrt(x[lane]);
  return x;
}

// The sum of a vector's elements.
inline float sum(Vector vector) {
  for (int width = kWidth; width > 1; width /= 2) {
    for (int i = 0; i < width / 2; ++i) vector[i] += vector[i + width / 2];
  }
  return vector[0];
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
