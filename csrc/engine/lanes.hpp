// Vectors of floats that hold several environments side by side, one per lane.
//
// Box2D has no counterpart: it solves one world at a time. The vectors are the compiler's own (GCC
// and Clang): arithmetic and comparisons work lane by lane, each result is rounded as a float is,
// and `?:` selects lane by lane.
#pragma once

#include <cmath>
#include <cstddef>
#include <type_traits>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace touchdown::engine {

template <int W>
struct Lanes {
  typedef float Float __attribute__((vector_size(W * 4)));
  typedef int Bits __attribute__((vector_size(W * 4)));
};

template <int W>
using Floats = typename Lanes<W>::Float;

// The same number in every lane; `F` is a float or a vector of floats.
template <typename F>
constexpr F broadcast(float value) {
  if constexpr (std::is_same_v<F, float>) {
    return value;
  } else {
    return value - F{};  // not a sum, which would lose the sign of -0
  }
}

// An integer for each lane, as wide as the result of a comparison.
template <typename F>
using Whole = std::conditional_t<std::is_same_v<F, float>, int, decltype(F{} < F{})>;

// The smaller of two, lane by lane; the second where neither is smaller, as with zeros of different
// sign. x86 has instructions that do exactly this, but compilers do not recognise them in a
// selection.
#if defined(__x86_64__)
inline __m128 smaller(__m128 a, __m128 b) { return _mm_min_ps(a, b); }
inline __m128 larger(__m128 a, __m128 b) { return _mm_max_ps(a, b); }
#if defined(__AVX2__)
inline __m256 smaller(__m256 a, __m256 b) { return _mm256_min_ps(a, b); }
inline __m256 larger(__m256 a, __m256 b) { return _mm256_max_ps(a, b); }
#endif
#if defined(__AVX512F__)
inline __m512 smaller(__m512 a, __m512 b) { return _mm512_min_ps(a, b); }
inline __m512 larger(__m512 a, __m512 b) { return _mm512_max_ps(a, b); }
#endif
#else
inline Floats<4> smaller(Floats<4> a, Floats<4> b) { return a < b ? a : b; }
inline Floats<4> larger(Floats<4> a, Floats<4> b) { return a > b ? a : b; }
#endif

// Square roots, rounded as those of floats are.
inline float root(float a) { return std::sqrt(a); }
#if defined(__x86_64__)
inline __m128 root(__m128 a) { return _mm_sqrt_ps(a); }
#if defined(__AVX2__)
inline __m256 root(__m256 a) { return _mm256_sqrt_ps(a); }
#endif
#if defined(__AVX512F__)
inline __m512 root(__m512 a) { return _mm512_sqrt_ps(a); }
#endif
#else
inline Floats<4> root(Floats<4> a) {
  return Floats<4>{root(a[0]), root(a[1]), root(a[2]), root(a[3])};
}
#endif

// `condition ? a : b`, lane by lane.
template <typename Mask, typename T>
constexpr T pick(Mask condition, T a, T b) {
  return condition ? a : b;
}

constexpr bool any(bool condition) { return condition; }
constexpr bool all(bool condition) { return condition; }

template <typename Mask>
  requires(sizeof(Mask) == 16)
inline bool any(Mask mask) {
#if defined(__x86_64__)
  return _mm_movemask_ps(reinterpret_cast<__m128>(mask)) != 0;
#else
  return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
#endif
}

#if defined(__AVX2__)
template <typename Mask>
  requires(sizeof(Mask) == 32)
inline bool any(Mask mask) {
  return _mm256_movemask_ps(reinterpret_cast<__m256>(mask)) != 0;
}
#endif

#if defined(__AVX512DQ__)
template <typename Mask>
  requires(sizeof(Mask) == 64)
inline bool any(Mask mask) {
  return _mm512_movepi32_mask(reinterpret_cast<__m512i>(mask)) != 0;
}
#endif

#if !defined(__AVX512DQ__)
// Of vectors that are wider than the registers.
template <typename Mask>
#if defined(__AVX2__)
  requires(sizeof(Mask) > 32)
#else
  requires(sizeof(Mask) > 16)
#endif
inline bool any(Mask mask) {
  bool found = false;
  for (std::size_t lane = 0; lane < sizeof(Mask) / sizeof(int); ++lane) found |= mask[lane] != 0;
  return found;
}
#endif

template <typename Mask>
  requires(sizeof(Mask) >= 16)
inline bool all(Mask mask) {
  return !any(~mask);
}

}  // namespace touchdown::engine
