// Small matrix products whose accumulators stay in registers.
//
// Samples lie side by side in vectors: a panel is [feature][kPanel], kPanel = 2 vectors of samples,
// so that a weight is one scalar for all of them and layers of any width have no ragged edge.
#pragma once

#include <cstddef>
#include <cstring>

#if defined(_MSC_VER)
#error "GCC or Clang is needed, for their vectors"
#endif

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

constexpr int kWidth = TOUCHDOWN_WIDTH;  // floats in a vector
constexpr int kPanel = 2 * kWidth;       // samples in a panel

typedef float Vector __attribute__((vector_size(kWidth * 4), may_alias));

inline Vector load(const float* from) {
  Vector vector;
  std::memcpy(&vector, from, sizeof vector);
  return vector;
}

inline void store(float* to, Vector vector) { std::memcpy(to, &vector, sizeof vector); }

// − 0 leaves every value as it is, a zero's sign too, and compilers know it.
inline Vector spread(float value) { return value - Vector{}; }

typedef float Four __attribute__((vector_size(16), may_alias));

inline Four fold(Vector vector) {
  Four parts[kWidth / 4];
  std::memcpy(parts, &vector, sizeof parts);
  for (int half = kWidth / 8; half > 0; half /= 2) {
    for (int i = 0; i < half; ++i) parts[i] += parts[i + half];
  }
  return parts[0];
}

inline float sum(Vector vector) {
  const Four four = fold(vector);
  return (four[0] + four[2]) + (four[1] + four[3]);
}

// kRows rows of out = start + A·B for one panel: A(m, k) = a[m·row + k·column], B is [K][kPanel].
// Every element is one chain of fused multiply-adds over k, whatever tile it falls into, so that a
// value does not depend on what else is computed beside it.
template <int kRows>
inline void multiply_rows(const float* a, std::ptrdiff_t row, std::ptrdiff_t column, const float* b,
                          int depth, const float* start, float* out) {
  Vector left[kRows], right[kRows];
  for (int m = 0; m < kRows; ++m) left[m] = right[m] = spread(start ? start[m] : 0.0f);
  for (int k = 0; k < depth; ++k) {
    const Vector b_left = load(b + k * kPanel), b_right = load(b + k * kPanel + kWidth);
    for (int m = 0; m < kRows; ++m) {
      const Vector factor = spread(a[m * row + k * column]);
      left[m] += factor * b_left;
      right[m] += factor * b_right;
    }
  }
  for (int m = 0; m < kRows; ++m) {
    store(out + m * kPanel, left[m]);
    store(out + m * kPanel + kWidth, right[m]);
  }
}

// out = start + A·B for one panel, [rows][kPanel].
inline void multiply(const float* a, std::ptrdiff_t row, std::ptrdiff_t column, const float* b,
                     int rows, int depth, const float* start, float* out) {
  constexpr int kRows = TOUCHDOWN_ROWS;
  int m = 0;
  const auto next = [&](int taken) {
    m += taken;
    a += taken * row;
    out += taken * kPanel;
    if (start) start += taken;
  };
  for (; m + kRows <= rows;) {
    multiply_rows<kRows>(a, row, column, b, depth, start, out);
    next(kRows);
  }
  for (; m + 2 <= rows;) {
    multiply_rows<2>(a, row, column, b, depth, start, out);
    next(2);
  }
  if (m < rows) multiply_rows<1>(a, row, column, b, depth, start, out);
}

// kRows x kColumns elements of out = Σ over all samples of a[row]·b[column]; panels of a lie
// `a_panel` floats apart, those of b `b_panel`.
template <int kRows, int kColumns>
inline void correlate_tile(const float* a, std::ptrdiff_t a_panel, const float* b,
                           std::ptrdiff_t b_panel, int panels, float* out, std::ptrdiff_t row) {
  Vector total[kRows][kColumns] = {};
  for (int panel = 0; panel < panels; ++panel, a += a_panel, b += b_panel) {
    for (int half = 0; half < kPanel; half += kWidth) {
      Vector columns[kColumns];
      for (int n = 0; n < kColumns; ++n) columns[n] = load(b + n * kPanel + half);
      for (int m = 0; m < kRows; ++m) {
        const Vector factor = load(a + m * kPanel + half);
        for (int n = 0; n < kColumns; ++n) total[m][n] += factor * columns[n];
      }
    }
  }
  for (int m = 0; m < kRows; ++m) {
    for (int n = 0; n < kColumns; ++n) out[m * row + n] = sum(total[m][n]);
  }
}

template <int kRows>
inline void correlate_rows(const float* a, std::ptrdiff_t a_panel, const float* b,
                           std::ptrdiff_t b_panel, int panels, int columns, float* out,
                           std::ptrdiff_t row) {
  int n = 0;
  for (; n + 3 <= columns; n += 3) {
    correlate_tile<kRows, 3>(a, a_panel, b + n * kPanel, b_panel, panels, out + n, row);
  }
  for (; n < columns; ++n) {
    correlate_tile<kRows, 1>(a, a_panel, b + n * kPanel, b_panel, panels, out + n, row);
  }
}

// out[rows][columns] = Σ over all samples of a[row]·b[column].
inline void correlate(const float* a, std::ptrdiff_t a_panel, int rows, const float* b,
                      std::ptrdiff_t b_panel, int columns, int panels, float* out) {
  int m = 0;
  for (; m + 4 <= rows; m += 4) {
    correlate_rows<4>(a + m * kPanel, a_panel, b, b_panel, panels, columns, out + m * columns,
                      columns);
  }
  for (; m < rows; ++m) {
    correlate_rows<1>(a + m * kPanel, a_panel, b, b_panel, panels, columns, out + m * columns,
                      columns);
  }
}

// out[row] = Σ over all samples of a[row].
inline void total(const float* a, std::ptrdiff_t a_panel, int rows, int panels, float* out) {
  for (int m = 0; m < rows; ++m) {
    Vector left{}, right{};
    for (int panel = 0; panel < panels; ++panel) {
      left += load(a + panel * a_panel + m * kPanel);
      right += load(a + panel * a_panel + m * kPanel + kWidth);
    }
    out[m] = sum(left + right);
  }
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
