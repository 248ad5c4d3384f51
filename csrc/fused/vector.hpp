// Vectors of the kernel's instruction set.
#pragma once

#include <cstring>

#include "simd/kernel_target.hpp"

#if defined(_MSC_VER)
#error "GCC or Clang is needed, for their vector types"
#endif

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

constexpr int kWidth = TOUCHDOWN_WIDTH;  // floats in a vector

typedef float Vector __attribute__((vector_size(kWidth * 4), may_alias));

inline Vector load(const float* from) {
  Vector vector;
  std::memcpy(&vector, from, sizeof vector);
  return vector;
}

inline void store(float* to, Vector vector) { std::memcpy(to, &vector, sizeof vector); }

// Subtracting 0 leaves every value as it is, even the sign of a zero, and compilers know it.
inline Vector broadcast(float value) { return value - Vector{}; }

typedef float Four __attribute__((vector_size(16), may_alias));

inline Four sum_to_four(Vector vector) {
  Four parts[kWidth / 4];
  std::memcpy(parts, &vector, sizeof parts);
  for (int half = kWidth / 8; half > 0; half /= 2) {
    for (int i = 0; i < half; ++i) parts[i] += parts[i + half];
  }
  return parts[0];
}

// The sum of a vector's elements.
inline float sum(Vector vector) {
  const Four four = sum_to_four(vector);
  return (four[0] + four[2]) + (four[1] + four[3]);
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
