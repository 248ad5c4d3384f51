// Rows of floats, one per environment, into lanes and back: W rows of W floats are a matrix to be
// transposed. Compiled once per instruction set (see simd/kernel_target.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstring>

#include "engine/lanes.hpp"
#include "simd/kernel_target.hpp"

namespace touchdown::engine::TOUCHDOWN_KERNEL {
namespace {

template <int W, typename Float>
using Rows = std::array<Float*, static_cast<std::size_t>(W)>;

template <int W>
using Block = std::array<Floats<W>, static_cast<std::size_t>(W)>;

#if defined(__x86_64__)

// The first or the second halves of all quarters, interleaved; and the same two floats at a time.
inline __m128 low(__m128 a, __m128 b) { return _mm_unpacklo_ps(a, b); }
inline __m128 high(__m128 a, __m128 b) { return _mm_unpackhi_ps(a, b); }
inline __m128 low_pairs(__m128 a, __m128 b) { return _mm_shuffle_ps(a, b, 0x44); }
inline __m128 high_pairs(__m128 a, __m128 b) { return _mm_shuffle_ps(a, b, 0xee); }
inline void transpose_quarters(Block<4>&) {}

#if defined(__AVX2__)
inline __m256 low(__m256 a, __m256 b) { return _mm256_unpacklo_ps(a, b); }
inline __m256 high(__m256 a, __m256 b) { return _mm256_unpackhi_ps(a, b); }
inline __m256 low_pairs(__m256 a, __m256 b) { return _mm256_shuffle_ps(a, b, 0x44); }
inline __m256 high_pairs(__m256 a, __m256 b) { return _mm256_shuffle_ps(a, b, 0xee); }
inline void transpose_quarters(Block<8>& m) {
  for (std::size_t i = 0; i < 4; ++i) {
    const __m256 a = m[i], b = m[4 + i];
    m[i] = _mm256_permute2f128_ps(a, b, 0x20);
    m[4 + i] = _mm256_permute2f128_ps(a, b, 0x31);
  }
}
#endif

#if defined(__AVX512F__)
inline __m512 low(__m512 a, __m512 b) { return _mm512_unpacklo_ps(a, b); }
inline __m512 high(__m512 a, __m512 b) { return _mm512_unpackhi_ps(a, b); }
inline __m512 low_pairs(__m512 a, __m512 b) { return _mm512_shuffle_ps(a, b, 0x44); }
inline __m512 high_pairs(__m512 a, __m512 b) { return _mm512_shuffle_ps(a, b, 0xee); }
inline void transpose_quarters(Block<16>& m) {
  for (std::size_t i = 0; i < 4; ++i) {
    const __m512 even_ab = _mm512_shuffle_f32x4(m[i], m[4 + i], 0x88);
    const __m512 odd_ab = _mm512_shuffle_f32x4(m[i], m[4 + i], 0xdd);
    const __m512 even_cd = _mm512_shuffle_f32x4(m[8 + i], m[12 + i], 0x88);
    const __m512 odd_cd = _mm512_shuffle_f32x4(m[8 + i], m[12 + i], 0xdd);
    m[i] = _mm512_shuffle_f32x4(even_ab, even_cd, 0x88);
    m[4 + i] = _mm512_shuffle_f32x4(odd_ab, odd_cd, 0x88);
    m[8 + i] = _mm512_shuffle_f32x4(even_ab, even_cd, 0xdd);
    m[12 + i] = _mm512_shuffle_f32x4(odd_ab, odd_cd, 0xdd);
  }
}
#endif

// Four rows at a time within each quarter of a vector, then the quarters.
template <int W>
[[gnu::always_inline]] inline void transpose(Block<W>& m) {
  for (std::size_t i = 0; i < W; i += 4) {
    const Floats<W> low_ab = low(m[i], m[i + 1]);
    const Floats<W> high_ab = high(m[i], m[i + 1]);
    const Floats<W> low_cd = low(m[i + 2], m[i + 3]);
    const Floats<W> high_cd = high(m[i + 2], m[i + 3]);
    m[i] = low_pairs(low_ab, low_cd);
    m[i + 1] = high_pairs(low_ab, low_cd);
    m[i + 2] = low_pairs(high_ab, high_cd);
    m[i + 3] = high_pairs(high_ab, high_cd);
  }
  transpose_quarters(m);
}

#else

template <int W>
inline void transpose(Block<W>& m) {
  const Block<W> before = m;
  for (std::size_t i = 0; i < W; ++i) {
    for (std::size_t j = 0; j < W; ++j) m[i][j] = before[j][i];
  }
}

#endif

// Puts `N` floats of each row into lanes: `N` vectors, with `stride` vectors from one to the next.
// Rows are read up to the next multiple of W.
template <std::size_t N, int W>
[[gnu::always_inline]] inline void load_rows(void* lanes, const Rows<W, const float>& rows,
                                             std::size_t stride = 1) {
  constexpr std::size_t width = W;
  auto* const to = static_cast<Floats<W>*>(lanes);
  for (std::size_t first = 0; first < N; first += width) {
    Block<W> block;
    for (std::size_t i = 0; i < width; ++i) {
      std::memcpy(&block[i], rows[i] + first, sizeof(block[i]));
    }
    transpose<W>(block);
    const std::size_t count = N - first < width ? N - first : width;
    for (std::size_t i = 0; i < count; ++i) {
      std::memcpy(to + (first + i) * stride, &block[i], sizeof(block[i]));
    }
  }
}

// Takes `N` floats of each of the first `used` rows out of lanes.
template <std::size_t N, int W>
[[gnu::always_inline]] inline void store_rows(const void* lanes, const Rows<W, float>& rows,
                                              std::size_t used, std::size_t stride = 1) {
  constexpr std::size_t width = W;
  constexpr std::size_t rest = N % width;
  const auto* const from = static_cast<const Floats<W>*>(lanes);
  for (std::size_t first = 0; first + width <= N; first += width) {
    Block<W> block;
    for (std::size_t i = 0; i < width; ++i) {
      std::memcpy(&block[i], from + (first + i) * stride, sizeof(block[i]));
    }
    transpose<W>(block);
    for (std::size_t i = 0; i < used; ++i) {
      std::memcpy(rows[i] + first, &block[i], sizeof(block[i]));
    }
  }
  if constexpr (rest != 0) {
    Block<W> block{};
    for (std::size_t i = 0; i < rest; ++i) {
      std::memcpy(&block[i], from + (N - rest + i) * stride, sizeof(block[i]));
    }
    transpose<W>(block);
    for (std::size_t i = 0; i < used; ++i) {
      std::memcpy(rows[i] + (N - rest), &block[i], rest * sizeof(float));
    }
  }
}

}  // namespace
}  // namespace touchdown::engine::TOUCHDOWN_KERNEL
