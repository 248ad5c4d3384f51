// Several environments side by side in one vector register, a lane each.
//
// The vectors are the compiler's own (GCC and Clang): arithmetic and comparisons go lane by lane,
// each rounded as a float is, and `?:` selects lane by lane.
#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace touchdown {

template <int W>
struct Lanes {
  typedef float Float __attribute__((vector_size(W * 4)));
  typedef int Bits __attribute__((vector_size(W * 4)));
};

template <int W>
using Floats = typename Lanes<W>::Float;

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

template <typename Mask>
  requires(sizeof(Mask) >= 16)
inline bool all(Mask mask) {
  return !any(~mask);
}

}  // namespace touchdown
